#include "panelgate/tap/habits.hpp"

#include <algorithm>

#include "panelgate/modbus/response.hpp"

namespace panelgate::tap {

void GiveUp::seen(Duration interval) {
    seen_.push_back(interval);
    if (seen_.size() > kKept) seen_.pop_front();
    outwaited_.clear();
}

void GiveUp::outwaited(Duration interval) {
    outwaited_.push_back(interval);
    if (outwaited_.size() < kNeeded) return;
    const Duration waited = *std::ranges::min_element(outwaited_);
    std::erase_if(seen_, [&](Duration given_up) { return given_up <= waited; });
    outwaited_.clear();
    refuted_ = true;
}

std::optional<Duration> GiveUp::least() const {
    if (seen_.size() < kNeeded) return std::nullopt;
    return *std::ranges::min_element(seen_);
}

void Habits::answered(Duration think) {
    constexpr int kMemory = 64;  // replies, until one slow one is all but forgotten
    longest_ = longest_ ? std::max(think, *longest_ - (*longest_ - think) / kMemory) : think;
    owed_.clear();
    usual_ = 0;
}

void Habits::answered_perhaps(Duration think) {
    constexpr int kEnough = 2;
    constexpr Duration kJitter = 2ms;
    const bool usual = longest_ && think <= *longest_ + *longest_ / 4 + kJitter;
    usual_ = usual ? usual_ + 1 : 0;
    if (usual_ < kEnough) return;
    owed_.clear();
    usual_ = 0;
}

void Habits::owes(TimePoint asked, const Bytes& request) {
    owed_.push_back({asked, request});
    if (owed_.size() > settings_.owed) owed_.pop_front();
    usual_ = 0;
}

bool Habits::owes_other(TimePoint now, const Bytes& request, ByteView reply) const {
    return std::ranges::any_of(owed_, [&](const Owed& owed) {
        return is_open(owed, now) && owed.request != request &&
               modbus::answers(owed.request, reply);
    });
}

std::optional<TimePoint> Habits::owed_since(TimePoint now, const Bytes& request) const {
    const auto same = std::ranges::find_if(
        owed_, [&](const Owed& owed) { return is_open(owed, now) && owed.request == request; });
    if (same == owed_.end()) return std::nullopt;
    return same->asked;
}

bool Habits::is_owed(TimePoint now, ByteView reply) const {
    return std::ranges::any_of(owed_, [&](const Owed& owed) {
        return is_open(owed, now) && modbus::answers(owed.request, reply);
    });
}

bool Habits::settle(TimePoint now, ByteView reply) {
    const auto answered = std::ranges::find_if(owed_, [&](const Owed& owed) {
        return is_open(owed, now) && modbus::answers(owed.request, reply);
    });
    if (answered == owed_.end()) return false;
    owed_.erase(owed_.begin(), answered + 1);
    return true;
}

}  // namespace panelgate::tap
