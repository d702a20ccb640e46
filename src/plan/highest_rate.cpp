#include "panelgate/plan/highest_rate.hpp"

#include <algorithm>
#include <utility>

namespace panelgate::plan {
namespace {

constexpr int kDoublings = 40;
constexpr int kHalvings = 24;

LinePlan at(const Line& line, double times) { return make_plan(at_intervals(line, 1 / times)); }

/// Where all load is in proportion.
double proportional(const LinePlan& plan) {
    return std::min(kHigh / plan.load, kFull / std::max(plan.most, plan.load));
}

/// What a refresh or a limit of extra turns holds down lets the rest go further, or less far.
double search(const Line& line, double first) {
    const auto is_fine = [&](double times) { return verdict(at(line, times)) == Verdict::fine; };
    double low = first;
    double high = first;
    for (int i = 0; i < kDoublings && !is_fine(low); ++i) high = std::exchange(low, low / 2);
    for (int i = 0; i < kDoublings && high == low && is_fine(high * 2); ++i) low = high *= 2;
    if (high == low) high *= 2;
    for (int i = 0; i < kHalvings; ++i) {
        const double middle = (low + high) / 2;
        (is_fine(middle) ? low : high) = middle;
    }
    return low;
}

}  // namespace

std::optional<HighestRate> highest_rate(const Line& line, const LinePlan& plan) {
    if (plan.load <= 0) return std::nullopt;
    HighestRate found{proportional(plan), false};
    if (!line.relays.empty()) found.times = search(line, found.times);
    const LinePlan then = at(line, found.times);
    found.changing = then.most / kFull > then.load / kHigh;
    return found;
}

}  // namespace panelgate::plan
