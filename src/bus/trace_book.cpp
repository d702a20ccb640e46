#include "trace_book.hpp"

#include <utility>

#include "panelgate/rt/log.hpp"

namespace panelgate::bus {

TraceBook::TraceBook(const Settings& settings, Wall& wall)
    : settings_(settings),
      wall_(wall),
      frames_(settings.trace_frames),
      decisions_(settings.trace_decisions) {}

void TraceBook::note(TimePoint at, FrameKind kind, Bytes bytes, arbiter::Reason why) {
    if (rt::log_enabled(rt::LogLevel::trace)) {
        rt::log(rt::LogLevel::trace, "frame",
                {{"line", settings_.name},
                 {"what", std::string(label(kind))},
                 {"bytes", to_hex(bytes)},
                 {"why", text_of(why)}});
    }
    RecordedFrame frame;
    frame.sequence = ++happened_;
    frame.at = at;
    frame.kind = kind;
    frame.bytes = std::move(bytes);
    frame.why = std::move(why);
    frame.time = wall_.at(at);
    frames_.add(std::move(frame));
}

void TraceBook::decide(TimePoint at, std::string text) {
    if (rt::log_enabled(rt::LogLevel::trace))
        rt::log(rt::LogLevel::trace, "decision", {{"line", settings_.name}, {"why", text}});
    decisions_.add({++happened_, at, std::move(text), wall_.at(at)});
}

}  // namespace panelgate::bus
