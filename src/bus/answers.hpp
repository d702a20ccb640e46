#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>
#include <vector>

#include "panelgate/bus/bus_client.hpp"

namespace panelgate::bus {

/// An answer on its way to whom it is for.
struct Handed {
    AnswerHandler handler;
    Answer answer;
};

/// Hands answers over from the loop, in their order, all that there are in one turn of it. What an
/// answer leads to is answered in a later turn.
class Answers {
  public:
    /// What has not been handed over when it ends is handed over all the same.
    explicit Answers(boost::asio::any_io_executor executor);

    void add(Handed handed);

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

}  // namespace panelgate::bus
