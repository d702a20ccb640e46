#include "panelgate/doctor/sample.hpp"

#include <algorithm>
#include <array>

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
    &Symptoms::lower_case,
};
constexpr std::size_t kOthers = 2;  // mute_in_a_row, worst_lateness
static_assert(sizeof(Symptoms) ==
                  sizeof(std::uint64_t) * (kCounts.size() + kOthers + 2 * Symptoms::kPauses),
              "every count of Symptoms has to be in kCounts");

/// Applies `combine` to every count of both; the rest is that of `a`.
template <class Combine>
Symptoms each(Symptoms a, const Symptoms& b, Combine combine) {
    for (const auto count : kCounts) a.*count = combine(a.*count, b.*count);
    for (std::size_t i = 0; i < Symptoms::kPauses; ++i) {
        a.answered_after[i] = combine(a.answered_after[i], b.answered_after[i]);
        a.silent_after[i] = combine(a.silent_after[i], b.silent_after[i]);
    }
    return a;
}

line::UartErrors minus(const line::UartErrors& a, const line::UartErrors& b) {
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
        window.stations[id] = before == earlier.stations.end()
                                  ? symptoms
                                  : each(symptoms, before->second,
                                         [](std::uint64_t a, std::uint64_t b) { return a - b; });
    }
    window.broadcasts = later.broadcasts - earlier.broadcasts;
    if (later.uart) window.uart = minus(*later.uart, earlier.uart.value_or(line::UartErrors{}));
    return window;
}

}  // namespace panelgate::doctor
