#include "panelgate/doctor/doctor.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace panelgate::doctor {

namespace {

using arbiter::Symptoms;

constexpr std::array kCounts = {
    &Symptoms::answered,      &Symptoms::silent,           &Symptoms::disturbed,
    &Symptoms::collided,      &Symptoms::damaged_exact,    &Symptoms::damaged_short,
    &Symptoms::damaged_long,  &Symptoms::damaged_heads,    &Symptoms::damaged_bytes,
    &Symptoms::damaged_zeros, &Symptoms::damaged_odd,      &Symptoms::long_answered,
    &Symptoms::long_damaged,  &Symptoms::strays,           &Symptoms::doubled,
    &Symptoms::late,          &Symptoms::unasked,          &Symptoms::echoes,
    &Symptoms::wrong,         &Symptoms::requests,         &Symptoms::crc_swapped,
    &Symptoms::trailed,       &Symptoms::wrong_exceptions, &Symptoms::broadcast_replies,
    &Symptoms::lower_case,    &Symptoms::beheaded,         &Symptoms::misaddressed,
    &Symptoms::repeated,      &Symptoms::silences,         &Symptoms::delimited,
};
constexpr std::size_t kOthers = 2;  // mute_in_a_row, worst_lateness
static_assert(sizeof(Symptoms) ==
                  sizeof(std::uint64_t) * (kCounts.size() + kOthers + 2 * Symptoms::kPauses),
              "every count of Symptoms has to be in kCounts");

/// Applies `combine` to every counter of both; other values are those of `a`.
template <class Combine>
Symptoms each(Symptoms a, const Symptoms& b, Combine combine) {
    for (const auto count : kCounts) a.*count = combine(a.*count, b.*count);
    for (std::size_t i = 0; i < Symptoms::kPauses; ++i) {
        a.answered_after[i] = combine(a.answered_after[i], b.answered_after[i]);
        a.silent_after[i] = combine(a.silent_after[i], b.silent_after[i]);
    }
    return a;
}

/// True if a count of `later` is smaller: its counter has begun anew, and so have all beside it.
bool began_anew(const Symptoms& later, const Symptoms& earlier) {
    bool smaller = false;
    each(later, earlier, [&](std::uint64_t a, std::uint64_t b) {
        smaller = smaller || a < b;
        return a;
    });
    return smaller;
}

bool began_anew(const line::UartErrors& later, const line::UartErrors& earlier) {
    return later.framing < earlier.framing || later.parity < earlier.parity ||
           later.overruns < earlier.overruns || later.breaks < earlier.breaks;
}

Symptoms minus(const Symptoms& a, const Symptoms& b) {
    if (began_anew(a, b)) return a;
    return each(a, b, [](std::uint64_t x, std::uint64_t y) { return x - y; });
}

line::UartErrors minus(const line::UartErrors& a, const line::UartErrors& b) {
    if (began_anew(a, b)) return a;
    return {a.framing - b.framing, a.parity - b.parity, a.overruns - b.overruns,
            a.breaks - b.breaks};
}

}  // namespace

Symptoms Sample::total() const {
    Symptoms sum;
    for (const auto& [id, symptoms] : stations) {
        sum = each(sum, symptoms, [](std::uint64_t a, std::uint64_t b) { return a + b; });
        sum.mute_in_a_row = std::max(sum.mute_in_a_row, symptoms.mute_in_a_row);
        sum.worst_lateness = std::max(sum.worst_lateness, symptoms.worst_lateness);
    }
    return sum;
}

std::uint64_t Sample::attempts() const {
    std::uint64_t sum = 0;
    for (const auto& [id, symptoms] : stations) sum += symptoms.attempts();
    return sum;
}

Sample difference(const Sample& later, const Sample& earlier) {
    Sample window;
    for (const auto& [id, symptoms] : later.stations) {
        const auto before = earlier.stations.find(id);
        window.stations[id] =
            before == earlier.stations.end() ? symptoms : minus(symptoms, before->second);
    }
    window.broadcasts = later.broadcasts - earlier.broadcasts;
    window.telnet = later.telnet;
    if (later.uart) window.uart = minus(*later.uart, earlier.uart.value_or(line::UartErrors{}));
    return window;
}

namespace {

bool holds(const std::vector<Finding>& list, const Finding& finding) {
    return std::ranges::any_of(
        list, [&](const Finding& other) { return other.is_about_the_same(finding); });
}

/// Returns the findings of `list` that `other` does not have.
std::vector<Finding> without(const std::vector<Finding>& list, const std::vector<Finding>& other) {
    std::vector<Finding> rest;
    for (const Finding& finding : list) {
        if (!holds(other, finding)) rest.push_back(finding);
    }
    return rest;
}

}  // namespace

Doctor::Doctor(Settings settings, LineFacts facts)
    : settings_(settings), facts_(std::move(facts)) {}

/// A station that was left out counts from zero when it is back, however much that is by then.
void Doctor::apply(LineFacts facts) {
    facts_ = std::move(facts);
    for (Mark& mark : marks_) {
        std::erase_if(mark.counted.stations, [&](const auto& station) {
            return station.first != 0 && !facts_.names.contains(station.first);
        });
    }
}

void Doctor::begin(TimePoint now, Sample counted) {
    if (!marks_.empty()) {
        const Sample window = difference(counted, marks_.front().counted);
        const arbiter::Symptoms all = window.total();
        // Damage that continues across reopenings is one fault.
        if (all.damaged() > 0 && all.answered == 0) return;
    }
    marks_.clear();
    marks_.push_back({now, std::move(counted)});
    looked_ = now;
}

Doctor::Change Doctor::look(TimePoint now, const Sample& counted) {
    if (marks_.empty()) begin(now, counted);
    looked_ = now;
    const Sample window = difference(counted, marks_.front().counted);
    Change change;
    if (window.attempts() > 0) {
        std::vector<Finding> found = diagnose(facts_, window, findings_);
        change.appeared = without(found, findings_);
        change.gone = without(findings_, found);
        findings_ = std::move(found);
    }
    if (due(now)) move_window(now, counted);
    return change;
}

std::vector<Finding> Doctor::withdraw_silence() {
    std::vector<Finding> withdrawn;
    std::erase_if(findings_, [&](const Finding& finding) {
        const bool silent = finding.cause == Cause::station_silent;
        if (silent) withdrawn.push_back(finding);
        return silent;
    });
    return withdrawn;
}

void Doctor::move_window(TimePoint now, const Sample& counted) {
    marks_.push_back({now, counted});
    while (marks_.size() > 2) {
        const Mark& next = marks_[1];
        const bool enough = now - next.at >= settings_.window &&
                            difference(counted, next.counted).attempts() >= settings_.attempts;
        if (!enough && marks_.size() <= settings_.marks) return;
        marks_.pop_front();
    }
}

}  // namespace panelgate::doctor
