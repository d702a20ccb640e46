#include "panelgate/bus/flight_recorder.hpp"

namespace panelgate::bus {

std::vector<TraceFrame> in_words(std::vector<RecordedFrame> frames) {
    std::vector<TraceFrame> told;
    told.reserve(frames.size());
    for (RecordedFrame& frame : frames) {
        told.push_back({frame.sequence, frame.at, frame.kind, std::move(frame.bytes),
                        text_of(frame.why), frame.time});
    }
    return told;
}

}  // namespace panelgate::bus
