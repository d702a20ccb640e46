#include "station_events.hpp"

#include <cmath>
#include <string>

#include "panelgate/rt/log.hpp"

namespace panelgate::bus {

void log_event(const Settings& settings, const arbiter::StationEvent& event) {
    const std::string station = name_of(settings.stations, event.station);
    const std::string ms = std::to_string(std::lround(std::ceil(to_milliseconds(event.by))));
    const auto say = [&](rt::LogLevel level, const char* what, const std::string& hint) {
        if (hint.empty()) {
            rt::log(level, what, {{"line", settings.name}, {"station", station}});
        } else {
            rt::log(level, what, {{"line", settings.name}, {"station", station}, {"hint", hint}});
        }
    };
    switch (event.kind) {
        case arbiter::StationEvent::Kind::offline:
            return say(rt::LogLevel::warn, "station offline", "");
        case arbiter::StationEvent::Kind::online:
            return say(rt::LogLevel::info, "station online", "");
        case arbiter::StationEvent::Kind::late:
            // Behind a wait that was cut short no setting is wrong.
            if (event.by <= Duration::zero()) return say(rt::LogLevel::info, "late reply", "");
            return say(rt::LogLevel::warn, "late reply",
                       "raise its response_timeout by at least " + ms + "ms");
        case arbiter::StationEvent::Kind::drift:
            return say(rt::LogLevel::warn, "station has become slow",
                       "it takes up to " + ms + "ms, near its response_timeout; raise that");
        case arbiter::StationEvent::Kind::collision:
            return say(rt::LogLevel::warn, "collision",
                       "the echo is not what was sent: is there another master, or no echo?");
        case arbiter::StationEvent::Kind::echo:
            return say(
                settings.arbiter.echo == EchoMode::off ? rt::LogLevel::warn : rt::LogLevel::info,
                "line hears itself", "its echo is checked and taken out");
        case arbiter::StationEvent::Kind::trail:
            return say(rt::LogLevel::warn, "bytes behind its replies",
                       "the line now waits up to " + ms +
                           "ms for them; look at how its transceiver lets go of the line");
    }
}

}  // namespace panelgate::bus
