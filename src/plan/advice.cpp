#include "panelgate/plan/advice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "panelgate/base/number_text.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::plan {
namespace {

using yaml::format_duration;

constexpr std::array kRates{2400, 4800, 9600, 19200, 38400, 57600, 115200};

bool all_have(const Line& line, int baud) {
    return std::ranges::all_of(line.stations, [&](const Station& station) {
        return profile::allows(station.profile->serial.baud, baud);
    });
}

/// The lowest rate that is enough, else the highest that all panels have.
std::optional<Advice> rate(const Line& line) {
    std::optional<Advice> found;
    for (const int baud : kRates) {
        if (baud <= line.serial.baud || !all_have(line, baud)) continue;
        found = Advice{"serial: {baud: " + std::to_string(baud) + "} (of all panels, too)",
                       make_plan(at_rate(line, baud)).load};
        if (found->load <= kHigh) break;
    }
    return found;
}

/// Up to two digits, which people would choose.
Duration rounded_up(Duration duration) {
    Duration unit = 1ms;
    while (duration > 20 * unit) unit *= 10;
    return (duration + unit - Duration(1)) / unit * unit;
}

/// The dearest poll alone, where that is enough and it need not become ten times as rare.
std::optional<Advice> dearest_poll(const LinePlan& plan) {
    const auto dearest = std::ranges::max_element(plan.polls, {}, &Poll::load);
    if (dearest == plan.polls.end()) return std::nullopt;
    const double left = kHigh - (plan.load - dearest->load);
    if (left < dearest->load / 10) return std::nullopt;
    const Duration every = rounded_up(std::chrono::duration_cast<Duration>(
        std::chrono::duration<double>(to_seconds(dearest->wire) / left)));
    if (every <= dearest->every) return std::nullopt;
    const double load = plan.load - dearest->load + to_seconds(dearest->wire) / to_seconds(every);
    return Advice{"read " + dearest->station + ' ' + dearest->read + " (" +
                      std::to_string(dearest->count) + ") every " + format_duration(every) +
                      " instead of " + format_duration(dearest->every),
                  load};
}

std::optional<Advice> all_intervals(const LinePlan& plan) {
    const double factor = std::ceil(plan.load / kHigh * 10) / 10;
    if (factor <= 1) return std::nullopt;
    return Advice{"all intervals " + number_text(factor) + " times as long", plan.load / factor};
}

/// One relay in the place of both; nothing where no request holds so many.
std::optional<Relay> merged(const Line& line, const Relay& a, const Relay& b) {
    if (!a.continues_in(b)) return std::nullopt;
    Relay both = a;
    both.from->span.count += b.from->span.count;
    both.to->span.count += b.to->span.count;
    const std::uint32_t most =
        modbus::is_bit_table(both.to->span.table) ? 1968 : 123;  // AP 6.11, 6.12
    const points::PlanLimits limits = limits_of(line, line.stations[both.from->station]);
    const bool fits = both.to->span.count <= most &&
                      both.from->span.count <= limits.of(both.from->span.table).max_items;
    return fits ? std::optional(both) : std::nullopt;
}

/// Joins the first two that can be; false when there are none.
bool merge_two(Line& line, std::string& which) {
    for (Relay& first : line.relays) {
        for (auto next = line.relays.begin(); next != line.relays.end(); ++next) {
            const auto both = merged(line, first, *next);
            if (!both) continue;
            which += (which.empty() ? "" : ", ") + first.name + " and " + next->name;
            first = *both;
            line.relays.erase(next);
            return true;
        }
    }
    return false;
}

/// Points and poll blocks are joined anyway.
std::optional<Advice> merged_relays(const Line& line) {
    Line made = line;
    std::string which;
    while (merge_two(made, which)) {
    }
    if (which.empty()) return std::nullopt;
    return Advice{"one relay instead of " + which, make_plan(made).load};
}

}  // namespace

std::vector<Advice> advise(const Line& line, const LinePlan& plan) {
    std::vector<Advice> all;
    if (verdict(plan) == Verdict::fine) return all;
    const auto candidates = {rate(line), dearest_poll(plan), all_intervals(plan),
                             merged_relays(line)};
    for (const std::optional<Advice>& one : candidates) {
        if (one && one->load < plan.load) all.push_back(*one);
    }
    return all;
}

}  // namespace panelgate::plan
