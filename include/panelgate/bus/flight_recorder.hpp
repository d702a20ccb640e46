#pragma once

#include <cstddef>
#include <deque>
#include <vector>

#include "panelgate/bus/bus_client.hpp"

namespace panelgate::bus {

/// Keeps the last frames of a line.
class FlightRecorder {
  public:
    explicit FlightRecorder(std::size_t limit = 2000) : limit_(limit) {}

    /// Numbers the frame and forgets the oldest when full.
    void add(TraceFrame frame) {
        frame.sequence = ++sequence_;
        frames_.push_back(std::move(frame));
        if (frames_.size() > limit_) frames_.pop_front();
    }
    /// The last ones, oldest first.
    std::vector<TraceFrame> last(std::size_t count) const {
        const std::size_t n = std::min(count, frames_.size());
        return {frames_.end() - static_cast<std::ptrdiff_t>(n), frames_.end()};
    }

  private:
    std::size_t limit_;
    std::deque<TraceFrame> frames_;
    std::uint64_t sequence_ = 0;
};

}  // namespace panelgate::bus
