#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>

#include "panelgate/mqtt/subjects.hpp"

namespace panelgate::mqtt {

/// The changes that the broker has not acknowledged, in their order: those that were sent first,
/// then those that wait. When it is full, the oldest that waits goes and is counted. Pure.
class Store {
  public:
    /// `limit`: changes; more than are ever sent and not acknowledged.
    explicit Store(std::size_t limit) : limit_(limit) {}

    void add(std::size_t subject, State state);
    /// The next to be sent; null: nothing waits. Stays until sent() or skip().
    const Change* next() const;
    void sent();
    /// Nothing is to be said of it.
    void skip();
    /// The broker has it; numbers that are not there any more mean nothing.
    void delivered(std::uint64_t number);
    /// Whatever was sent and not acknowledged has to be sent again.
    void lost() { sent_ = 0; }

    const std::deque<Change>& changes() const { return changes_; }
    std::size_t size() const { return changes_.size(); }
    std::size_t in_flight() const { return sent_; }
    std::uint64_t dropped() const { return dropped_; }
    /// Of the change that is added next.
    std::uint64_t next_number() const { return next_number_; }

  private:
    void erase(std::size_t place);

    std::size_t limit_;
    std::deque<Change> changes_;
    std::size_t sent_ = 0;
    std::uint64_t dropped_ = 0;
    std::uint64_t next_number_ = 1;
};

}  // namespace panelgate::mqtt
