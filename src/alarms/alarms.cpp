#include "panelgate/alarms/alarms.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace panelgate::alarms {

namespace {

constexpr std::array<std::string_view, 4> kStates = {"normal", "active", "acknowledged", "cleared"};

/// Whether the condition holds at this value; between limit and `back` nothing changes.
bool holds_at(const Settings& alarm, bool held, double value) {
    if (alarm.above) return value > (held ? alarm.back.value_or(*alarm.above) : *alarm.above);
    if (alarm.below) return value < (held ? alarm.back.value_or(*alarm.below) : *alarm.below);
    return alarm.equals == value;
}

}  // namespace

std::string_view label(State state) { return kStates[static_cast<std::size_t>(state)]; }

std::optional<State> state_of(std::string_view label) {
    const auto* const found = std::ranges::find(kStates, label);
    if (found == kStates.end()) return std::nullopt;
    return static_cast<State>(found - kStates.begin());
}

void Alarms::apply(std::vector<Settings> settings) {
    std::vector<Alarm> before = std::exchange(alarms_, {});
    for (Settings& one : settings) {
        const auto known = std::ranges::find(before, one, &Alarm::settings);
        if (known != before.end())
            alarms_.push_back(std::move(*known));
        else
            alarms_.push_back({std::move(one)});
    }
}

void Alarms::restore(std::string_view name, Status status) {
    const auto found = find(name);
    if (found) alarms_[*found].status = std::move(status);
}

std::optional<std::size_t> Alarms::find(std::string_view name) const {
    const auto found = std::ranges::find(
        alarms_, name, [](const Alarm& one) -> std::string_view { return one.settings.name; });
    if (found == alarms_.end()) return std::nullopt;
    return static_cast<std::size_t>(found - alarms_.begin());
}

/// The condition must hold for its delay before the alarm is raised; the alarm ends at once, with
/// the hysteresis of `back`.
std::optional<Change> Alarms::observe(Alarm& alarm, Time time, bool holds) {
    alarm.holds = holds;
    if (holds == alarm.status.is_active()) {
        alarm.due.reset();
        return std::nullopt;
    }
    if (!holds) return clear(alarm, time);
    if (!alarm.due) alarm.due = time.now + alarm.settings.delay;
    if (*alarm.due > time.now) return std::nullopt;
    return raise(alarm, time);
}

Change Alarms::raise(Alarm& alarm, Time time) {
    alarm.due.reset();
    alarm.status.state = State::active;
    alarm.status.since = time.wall;
    alarm.status.by.clear();
    return {Change::Kind::raised, &alarm.settings, alarm.status};
}

Change Alarms::clear(Alarm& alarm, Time time) {
    const bool known = alarm.status.state == State::acknowledged;
    alarm.status.state = known ? State::normal : State::cleared;
    alarm.status.since = time.wall;
    return {Change::Kind::cleared, &alarm.settings, alarm.status};
}

std::optional<Change> Alarms::on_value(std::size_t index, Time time, std::optional<double> value) {
    Alarm& alarm = alarms_[index];
    if (value) alarm.status.value = value;
    if (alarm.settings.stale) return observe(alarm, time, !value);
    if (value) return observe(alarm, time, holds_at(alarm.settings, alarm.holds, *value));
    // What is not known neither raises nor clears.
    alarm.due.reset();
    return std::nullopt;
}

std::optional<Change> Alarms::on_condition(std::size_t index, Time time, bool holds) {
    return observe(alarms_[index], time, holds);
}

std::vector<Change> Alarms::on_time(Time time) {
    std::vector<Change> changes;
    for (Alarm& alarm : alarms_)
        if (alarm.due && *alarm.due <= time.now) changes.push_back(raise(alarm, time));
    return changes;
}

std::optional<TimePoint> Alarms::next() const {
    std::optional<TimePoint> next;
    for (const Alarm& alarm : alarms_)
        if (alarm.due) next = std::min(next.value_or(*alarm.due), *alarm.due);
    return next;
}

std::optional<Change> Alarms::acknowledge(std::string_view name, std::string by) {
    const auto found = find(name);
    if (!found) return std::nullopt;
    Alarm& alarm = alarms_[*found];
    Status& status = alarm.status;
    if (status.state != State::active && status.state != State::cleared) return std::nullopt;
    status.state = status.state == State::active ? State::acknowledged : State::normal;
    status.by = std::move(by);
    return Change{Change::Kind::acknowledged, &alarm.settings, status};
}

}  // namespace panelgate::alarms
