#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <ranges>
#include <utility>
#include <vector>

#include "panelgate/arbiter/reason.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/frame_kind.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/wall_time.hpp"
#include "panelgate/bus/bus_client.hpp"

namespace panelgate::bus {

/// Keeps the last of what happens on a line. Entry has a `sequence`, which only grows.
template <class Entry>
class Recorder {
  public:
    explicit Recorder(std::size_t limit) : limit_(limit) {}

    /// Forgets the oldest when full.
    void add(Entry entry) {
        if (entries_.size() < limit_) {
            entries_.push_back(std::move(entry));
        } else if (limit_ > 0) {
            entries_[oldest_] = std::move(entry);
            oldest_ = (oldest_ + 1) % limit_;
        }
    }
    /// The last ones, oldest first.
    std::vector<Entry> last(std::size_t count) const {
        return some(entries_.size() - std::min(count, entries_.size()), count);
    }
    /// The first ones behind this number, oldest first.
    std::vector<Entry> since(std::uint64_t sequence, std::size_t most) const {
        const auto places = std::views::iota(std::size_t{0}, entries_.size());
        const auto first = std::ranges::upper_bound(
            places, sequence, {}, [this](std::size_t place) { return at(place).sequence; });
        return some(static_cast<std::size_t>(first - places.begin()), most);
    }

  private:
    const Entry& at(std::size_t place) const {
        return entries_[(oldest_ + place) % entries_.size()];
    }
    std::vector<Entry> some(std::size_t from, std::size_t most) const {
        std::vector<Entry> chosen;
        const std::size_t count = std::min(most, entries_.size() - from);
        chosen.reserve(count);
        for (std::size_t i = 0; i < count; ++i) chosen.push_back(at(from + i));
        return chosen;
    }

    std::size_t limit_;
    std::vector<Entry> entries_;  ///< a ring when it is full
    std::size_t oldest_ = 0;
};

/// As TraceFrame, but for the words.
struct RecordedFrame {
    std::uint64_t sequence = 0;
    TimePoint at;
    FrameKind kind = FrameKind::request;
    Bytes bytes;
    arbiter::Reason why{};
    WallTime time{};
};
std::vector<TraceFrame> in_words(std::vector<RecordedFrame> frames);

using FlightRecorder = Recorder<RecordedFrame>;
using DecisionRecorder = Recorder<TraceDecision>;

}  // namespace panelgate::bus
