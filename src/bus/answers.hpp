#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>
#include <vector>

#include "panelgate/bus/bus_client.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::bus {

/// An answer on its way to whom it is for.
struct Handed {
    AnswerHandler handler;
    Answer answer;
};

/// Hands answers over in their order, all that there are at a time, and never from inside the call
/// of somebody who asks.
class Answers {
  public:
    /// What has not been handed over when it ends is handed over all the same.
    explicit Answers(boost::asio::any_io_executor executor);

    /// `soon`: whoever adds it is called by the loop, and hand_over() follows. Else it is posted.
    void add(Handed handed, bool soon);
    void hand_over();

  private:
    struct Waiting {
        std::vector<Handed> next;
        std::vector<Handed> leaving;  ///< empty but while it is handed over
        bool posted = false;
        void hand_over();
    };

    boost::asio::any_io_executor executor_;
    std::shared_ptr<Waiting> waiting_;  ///< whoever hands over holds it as well
};

/// Refusals go out together, a millisecond apart: who asks again at once cannot keep the loop from
/// the wire (P4, P9). At most one waits a request that clients may have open.
class Refusals {
  public:
    Refusals(boost::asio::any_io_executor executor, rt::Clock& clock);
    /// Who still waits is told from the loop.
    ~Refusals();
    Refusals(const Refusals&) = delete;
    Refusals& operator=(const Refusals&) = delete;

    void add(Handed refused);

  private:
    boost::asio::any_io_executor executor_;
    rt::Clock& clock_;
    std::unique_ptr<rt::Alarm> alarm_;
    std::vector<Handed> waiting_;
};

}  // namespace panelgate::bus
