#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <vector>

#include "panelgate/bus/bus_client.hpp"

namespace panelgate::bus {

/// Numbers what happens on a line and keeps the last of it. Entry has a `sequence`.
template <class Entry>
class Recorder {
  public:
    explicit Recorder(std::size_t limit) : limit_(limit) {}

    /// Forgets the oldest when full.
    void add(Entry entry) {
        entry.sequence = ++sequence_;
        entries_.push_back(std::move(entry));
        if (entries_.size() > limit_) entries_.pop_front();
    }
    /// The last ones, oldest first.
    std::vector<Entry> last(std::size_t count) const {
        const std::size_t n = std::min(count, entries_.size());
        return {entries_.end() - static_cast<std::ptrdiff_t>(n), entries_.end()};
    }

  private:
    std::size_t limit_;
    std::deque<Entry> entries_;
    std::uint64_t sequence_ = 0;
};

using FlightRecorder = Recorder<TraceFrame>;
using DecisionRecorder = Recorder<TraceDecision>;

}  // namespace panelgate::bus
