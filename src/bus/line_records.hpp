#pragma once

#include <array>
#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "accounts.hpp"
#include "answers.hpp"
#include "client_names.hpp"
#include "line_doctor.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/bus/line_history.hpp"
#include "panelgate/line/line.hpp"
#include "panelgate/rt/log.hpp"
#include "trace_book.hpp"

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

/// What is recorded of a line, whether the line is driven or only listened to.
struct LineRecords {
    LineRecords(const boost::asio::any_io_executor& executor, rt::Clock& c, Settings s,
                std::unique_ptr<line::Line> l)
        : clock(c),
          settings(std::move(s)),
          line(std::move(l)),
          account(settings),
          doctor(settings),
          health_events(settings),
          load(c.now()),
          refusals(executor, clock),
          wall(clock),
          book(settings, wall) {}

    /// The line is down, whatever the cause: all that know something of the line are told together.
    /// `tell_machine()` tells the arbiter or the matcher.
    template <class TellMachine>
    void take_down(const std::string& why, TellMachine tell_machine) {
        const bool was_up = std::exchange(up, false);
        why_down = why;
        rt::log(rt::LogLevel::warn, "line down", {{"line", settings.name}, {"why", why}});
        // The end of a finding is an event of a line that is up: observers hear of it before the
        // end of the line.
        if (was_up) doctor.on_line_down();
        observe(settings, LineEvent{false, why});
        tell_machine();
        health_events.on_line_down();
        if (was_up) book.on_line_down(clock.now());
    }
    /// The line is closed for good, by a reload or at the end. Not a fault: nothing is logged.
    void leave();
    /// What is the same of both kinds of lines; `counts` are those of now.
    LineStatus status(const LineCounts& counts);
    LineReport report() const;

    rt::Clock& clock;
    Settings settings;
    std::unique_ptr<line::Line> line;
    Account account;
    std::map<std::string, std::uint64_t> denials{};  ///< by the name of the rule
    ClientNames names;
    LineDoctor doctor;
    HealthEvents health_events;
    LoadMeter load;
    Refusals refusals;
    Wall wall;
    TraceBook book;
    bool up = false;
    std::string why_down = "not opened yet";
};

}  // namespace panelgate::bus
