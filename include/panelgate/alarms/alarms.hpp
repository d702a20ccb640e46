#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/alarms/settings.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::alarms {

/// Active or not, acknowledged or not: the states of ISA 18.2 without latching and shelving.
enum class State : std::uint8_t {
    normal,        ///< the condition has ended, and somebody knows
    active,        ///< the condition holds, and nobody has acknowledged
    acknowledged,  ///< the condition holds, and somebody knows
    cleared        ///< the condition has ended, and nobody has acknowledged
};
/// "normal", "active", "acknowledged", "cleared".
std::string_view label(State state);
std::optional<State> state_of(std::string_view label);

/// An alarm as it is now.
struct Status {
    State state = State::normal;
    WallTime since{};               ///< when the condition began or ended
    std::optional<double> value{};  ///< that was read last, of an alarm of a point
    std::string by{};               ///< who acknowledged last; "": nobody

    bool is_active() const { return state == State::active || state == State::acknowledged; }
    friend bool operator==(const Status&, const Status&) = default;
};

/// What has changed, for the journal, events, MQTT, metrics and webhooks.
struct Change {
    enum class Kind : std::uint8_t { raised, cleared, acknowledged };
    Kind kind = Kind::raised;
    const Settings* alarm = nullptr;  ///< of the Alarms that returned the change
    Status now{};
};

/// All alarms of a gateway: conditions in, changes out. Pure; time is an argument. One thread.
class Alarms {
  public:
    /// Both clocks at one moment.
    struct Time {
        TimePoint now{};
        WallTime wall{};
    };

    /// Goes on with alarms of the same settings; another alarm begins as normal.
    void apply(std::vector<Settings> settings);
    /// A state from before a restart. An active alarm stays active until its condition is seen not
    /// to hold.
    void restore(std::string_view name, Status status);

    /// The point of an alarm was read; nullopt: the point is stale or bad now.
    std::optional<Change> on_value(std::size_t alarm, Time time, std::optional<double> value);
    /// Whether the station is offline, the line is down or the finding is there.
    std::optional<Change> on_condition(std::size_t alarm, Time time, bool holds);
    /// Delays that have passed. Call at next() or later.
    std::vector<Change> on_time(Time time);
    /// When on_time() should be called; nullopt: no delay runs.
    std::optional<TimePoint> next() const;
    /// An operator has seen the alarm. Returns nothing for an unknown name, and for an alarm that
    /// is normal or acknowledged.
    std::optional<Change> acknowledge(std::string_view name, std::string by);

    std::size_t size() const { return alarms_.size(); }
    const Settings& settings(std::size_t alarm) const { return alarms_[alarm].settings; }
    const Status& status(std::size_t alarm) const { return alarms_[alarm].status; }
    /// The index of an alarm; nullopt: there is none.
    std::optional<std::size_t> find(std::string_view name) const;

  private:
    struct Alarm {
        Settings settings{};
        Status status{};
        bool holds = false;              ///< the condition, without its delay
        std::optional<TimePoint> due{};  ///< when the condition counts
    };

    static std::optional<Change> observe(Alarm& alarm, Time time, bool holds);
    static Change raise(Alarm& alarm, Time time);
    static Change clear(Alarm& alarm, Time time);

    std::vector<Alarm> alarms_;
};

}  // namespace panelgate::alarms
