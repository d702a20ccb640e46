#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>

#include "accounts.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::bus {

/// The health of a line's stations as the observer has it. Each change is one
/// StationEvent, and always what REST shows.
class HealthEvents {
  public:
    /// The settings outlive it.
    explicit HealthEvents(const Settings& settings) : settings_(settings) {}

    void tell(std::uint8_t station, Health health);
    /// The line is down: every station is unknown.
    void on_line_down();
    /// Reports listed stations that `next` has not, or under another name, as unknown. Called
    /// before the settings change, while observers still know their names.
    void on_change(const Stations& next);

  private:
    const Settings& settings_;
    std::array<Health, 256> last_{};  ///< by station id; unknown at first
};

/// The line of a bus is down, whatever the cause: all that know something of it are told together.
/// `tell_machine(now)` tells the arbiter or the matcher.
template <class State, class TellMachine>
void take_down(State& bus, const std::string& why, TellMachine tell_machine) {
    const bool was_up = std::exchange(bus.up, false);
    bus.why_down = why;
    rt::log(rt::LogLevel::warn, "line down", {{"line", bus.settings.name}, {"why", why}});
    // Findings that go are events of a line that is up: they come before its end.
    if (was_up) bus.doctor.on_line_down();
    observe(bus.settings, LineEvent{false, why});
    bus.drive.hear(std::move(tell_machine));
    bus.health_events.on_line_down();
    if (was_up) bus.book.on_line_down(bus.clock.now());
}

/// The line is closed for good, by a reload or at the end. Not a fault: nothing is logged.
template <class State>
void leave_line(State& bus) {
    bus.why_down = "it is closed";
    if (!std::exchange(bus.up, false)) return;
    observe(bus.settings, LineEvent{false, bus.why_down});
    bus.health_events.on_line_down();
}

}  // namespace panelgate::bus
