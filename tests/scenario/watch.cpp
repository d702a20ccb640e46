#include "watch.hpp"

#include <algorithm>

namespace panelgate::scenario {

Watch::Watch(const Plan& plan) {
    for (const PanelPlan& panel : plan.panels) {
        Station& s = stations_[panel.id];
        s.sound = plan.is_sound(panel);
        s.only_dies = panel.only_dies();
    }
}

void Watch::on_collision(TimePoint now, std::uint8_t station) {
    const auto found = stations_.find(station);
    if (found == stations_.end()) return;
    found->second.disturbed = true;
    found->second.settled = now;
}

void Watch::on_upset(TimePoint now) {
    for (auto& [id, s] : stations_) {
        s.disturbed = true;
        s.settled = now;
    }
}

bool Watch::on_answered(TimePoint now, std::uint8_t station) {
    Station& s = stations_[station];
    const bool was_disturbed = s.disturbed;
    if (was_disturbed) s.settled = now;
    s.disturbed = s.silent = s.silent_to_reads = s.failing = false;
    return was_disturbed;
}

void Watch::on_unanswered(std::uint8_t station, bool silent, bool is_read) {
    Station& s = stations_[station];
    s.failing = true;
    s.silent = s.silent || silent;
    s.silent_to_reads = s.silent_to_reads || (silent && is_read);
}

void Watch::on_cost(TimePoint now, std::uint8_t station, Duration cost) {
    Station& s = stations_[station];
    s.paid = std::max(s.paid, now) + 4 * cost;
}

TimePoint Watch::paid(std::uint8_t station) const {
    const Station* s = find(station);
    return s == nullptr ? TimePoint{} : s->paid;
}

void Watch::on_owed(std::uint8_t station, TimePoint until) {
    Station& s = stations_[station];
    s.rests = std::max(s.rests, until);
}

TimePoint Watch::rests_until(std::uint8_t station) const {
    const Station* s = find(station);
    return s == nullptr ? TimePoint{} : s->rests;
}

bool Watch::is_failing(std::uint8_t station) const {
    const Station* s = find(station);
    return s != nullptr && s->failing;
}

bool Watch::is_good(std::uint8_t station, TimePoint since) const {
    const Station* s = find(station);
    return s != nullptr && s->sound && !s->disturbed && s->settled < since;
}

bool Watch::only_dies(std::uint8_t station) const {
    const Station* s = find(station);
    return s == nullptr || s->only_dies;
}

bool Watch::is_silent_to_reads(std::uint8_t station) const {
    const Station* s = find(station);
    return s != nullptr && s->silent_to_reads;
}

bool Watch::is_silent(std::uint8_t station) const {
    const Station* s = find(station);
    return s != nullptr && s->silent;
}

const Watch::Station* Watch::find(std::uint8_t station) const {
    const auto found = stations_.find(station);
    return found == stations_.end() ? nullptr : &found->second;
}

}  // namespace panelgate::scenario
