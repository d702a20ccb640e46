#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "panelgate/arbiter/reason.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/frame_kind.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/bus/flight_recorder.hpp"
#include "wall.hpp"

namespace panelgate::bus {

/// What happened on a line, frames and decisions in one sequence: kept for those who ask, and told
/// in the log at trace level. `settings` and `wall` outlive it.
class TraceBook {
  public:
    TraceBook(const Settings& settings, Wall& wall);

    void note(TimePoint at, FrameKind kind, Bytes bytes, arbiter::Reason why = {});
    void decide(TimePoint at, std::string text);

    std::vector<TraceFrame> frames(std::size_t last) const { return in_words(frames_.last(last)); }
    std::vector<TraceFrame> frames_since(std::uint64_t sequence, std::size_t most) const {
        return in_words(frames_.since(sequence, most));
    }
    const DecisionRecorder& decisions() const { return decisions_; }

  private:
    const Settings& settings_;
    Wall& wall_;
    std::uint64_t happened_ = 0;  ///< the last sequence number
    FlightRecorder frames_;
    DecisionRecorder decisions_;
};

}  // namespace panelgate::bus
