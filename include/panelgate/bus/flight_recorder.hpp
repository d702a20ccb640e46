#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <vector>

#include "panelgate/bus/bus_client.hpp"

namespace panelgate::bus {

/// Keeps the last of what happens on a line. Entry has a `sequence`, which only grows.
template <class Entry>
class Recorder {
  public:
    explicit Recorder(std::size_t limit) : limit_(limit) {}

    /// Forgets the oldest when full.
    void add(Entry entry) {
        entries_.push_back(std::move(entry));
        if (entries_.size() > limit_) entries_.pop_front();
    }
    /// The last ones, oldest first.
    std::vector<Entry> last(std::size_t count) const {
        const std::size_t n = std::min(count, entries_.size());
        return {entries_.end() - static_cast<std::ptrdiff_t>(n), entries_.end()};
    }
    /// The first ones behind this number, oldest first.
    std::vector<Entry> since(std::uint64_t sequence, std::size_t most) const {
        const auto first = std::ranges::upper_bound(entries_, sequence, {}, &Entry::sequence);
        const auto n =
            std::min<std::ptrdiff_t>(entries_.end() - first, static_cast<std::ptrdiff_t>(most));
        return {first, first + n};
    }

  private:
    std::size_t limit_;
    std::deque<Entry> entries_;
};

using FlightRecorder = Recorder<TraceFrame>;
using DecisionRecorder = Recorder<TraceDecision>;

}  // namespace panelgate::bus
