#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>
#include <vector>

#include "panelgate/bus/bus_client.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::bus {

/// An answer with the handler that receives it.
struct Delivery {
    AnswerHandler handler;
    Answer answer;
};

/// Delivers answers in order and in batches, never from inside a client's call.
class Answers {
  public:
    /// Undelivered answers are still delivered after destruction.
    explicit Answers(boost::asio::any_io_executor executor);

    /// `soon`: the caller runs from the loop and calls deliver() next. Otherwise deliver() is
    /// posted.
    void add(Delivery delivery, bool soon);
    void deliver();

  private:
    struct Waiting {
        std::vector<Delivery> next;
        std::vector<Delivery> delivering;  ///< empty except during delivery
        bool posted = false;
        void deliver();
    };

    boost::asio::any_io_executor executor_;
    std::shared_ptr<Waiting> waiting_;  ///< shared with a delivery in progress
};

/// Delivers refusals in batches, a millisecond apart: a client that retries at once cannot keep the
/// loop from the wire (P4, P9). Bounded by the number of requests that clients may have open.
class Refusals {
  public:
    Refusals(boost::asio::any_io_executor executor, rt::Clock& clock);
    /// Waiting refusals are delivered from the loop.
    ~Refusals();
    Refusals(const Refusals&) = delete;
    Refusals& operator=(const Refusals&) = delete;

    void add(Delivery refused);

  private:
    boost::asio::any_io_executor executor_;
    rt::Clock& clock_;
    std::unique_ptr<rt::Alarm> alarm_;
    std::vector<Delivery> waiting_;
};

}  // namespace panelgate::bus
