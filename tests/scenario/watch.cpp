#include "watch.hpp"

#include <algorithm>
#include <bit>

namespace panelgate::scenario {

Watch::Watch(const Plan& plan) {
    for (const PanelPlan& panel : plan.panels) {
        Station& s = stations_[panel.id];
        s.listed = panel.listed;
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

bool Watch::on_answered(TimePoint now, std::uint8_t station, Duration after) {
    Station& s = stations_[station];
    const bool was_disturbed = s.disturbed;
    if (was_disturbed) s.settled = now;
    s.disturbed = s.silent = s.failing = false;
    s.lately = static_cast<std::uint8_t>(s.lately << 1);
    s.slowest = std::max(s.slowest.value_or(after), after);
    slowest_ = std::max(slowest_.value_or(after), after);
    return was_disturbed;
}

void Watch::on_unanswered(TimePoint now, std::uint8_t station, bool silent) {
    last_unanswered_ = now;
    Station& s = stations_[station];
    s.failing = true;
    s.lately = static_cast<std::uint8_t>(s.lately << 1 | 1);
    s.silent = s.silent || silent;
}

void Watch::on_again(TimePoint now, std::uint8_t station) {
    last_unanswered_ = now;
    Station& s = stations_[station];
    s.lately = static_cast<std::uint8_t>(s.lately | 1);
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

bool Watch::is_silent(std::uint8_t station) const {
    const Station* s = find(station);
    return s != nullptr && s->silent;
}

bool Watch::is_known(std::uint8_t station) const {
    const Station* s = find(station);
    return s != nullptr && (s->listed || s->slowest);
}

bool Watch::has_answered(std::uint8_t station) const {
    const Station* s = find(station);
    return s != nullptr && s->slowest;
}

bool Watch::is_trusted(TimePoint now, std::uint8_t station) const {
    const Station* s = find(station);
    if (s == nullptr || !s->slowest || s->failing) return false;
    constexpr int kFew = 3;
    return std::popcount(s->lately) <= kFew && now > last_unanswered_ + 10s;
}

std::optional<Duration> Watch::slowest(std::uint8_t station) const {
    const Station* s = find(station);
    return s != nullptr && s->slowest ? s->slowest : slowest_;
}

Duration Watch::own_slowest(std::uint8_t station) const {
    const Station* s = find(station);
    return s != nullptr && s->slowest ? *s->slowest : Duration{};
}

const Watch::Station* Watch::find(std::uint8_t station) const {
    const auto found = stations_.find(station);
    return found == stations_.end() ? nullptr : &found->second;
}

}  // namespace panelgate::scenario
