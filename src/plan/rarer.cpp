#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "changes.hpp"
#include "panelgate/base/number_text.hpp"
#include "panelgate/points/settings.hpp"
#include "panelgate/yaml/map_reader.hpp"
#include "rounded_up.hpp"

namespace panelgate::plan {
namespace {

using yaml::format_duration;

constexpr int kRarest = 10;          // times, of one read alone
constexpr int kMostTenths = 10'000;  // of the factor for all

bool is_enough(const Line& line) { return verdict(make_plan(line)) == Verdict::fine; }

/// Reads that serve the same: several of a block that is cut.
struct Dearest {
    const Poll* first = nullptr;
    Duration wire{};
    double load = 0;
};

Dearest dearest_of(const LinePlan& plan) {
    std::map<std::pair<std::string, std::vector<std::size_t>>, Dearest> reads;
    for (const Poll& poll : plan.polls) {
        Dearest& sum = reads[{poll.station, poll.asked}];
        if (sum.first == nullptr) sum.first = &poll;
        sum.wire += poll.wire;
        sum.load += poll.load;
    }
    const auto dearest =
        std::ranges::max_element(reads, {}, [](const auto& entry) { return entry.second.load; });
    return dearest == reads.end() ? Dearest() : dearest->second;
}

/// What a read serves, as a range of one station's items.
struct Scope {
    std::size_t station = 0;
    const Asked* first = nullptr;
    const Asked* last = nullptr;

    bool holds(const Asked& asked) const {
        const modbus::Span& span = asked.want.span;
        return span.table == first->want.span.table && span.first >= first->want.span.first &&
               span.first <= last->want.span.first;
    }
};

Scope scope_of(const Line& line, const Poll& poll) {
    const auto station = std::ranges::find(line.stations, poll.station, &Station::name);
    Scope scope{static_cast<std::size_t>(station - line.stations.begin()), nullptr, nullptr};
    for (const std::size_t index : poll.asked) {
        const Asked& asked = station->asked[index];
        const std::uint32_t at = asked.want.span.first;
        if (scope.first == nullptr || at < scope.first->want.span.first) scope.first = &asked;
        if (scope.last == nullptr || at > scope.last->want.span.first) scope.last = &asked;
    }
    return scope;
}

Line with(const Line& line, const Scope& scope, Duration every) {
    Line made = line;
    for (Asked& asked : made.stations[scope.station].asked) {
        if (scope.holds(asked)) asked.want.every = std::max(asked.want.every, every);
    }
    return made;
}

/// "100ms", or "100ms to 130ms": what is asked more often than that now.
std::string intervals_of(const Line& line, const Scope& scope, Duration every) {
    Duration shortest = every;
    Duration longest{};
    for (const Asked& asked : line.stations[scope.station].asked) {
        if (!scope.holds(asked) || asked.want.every >= every) continue;
        shortest = std::min(shortest, asked.want.every);
        longest = std::max(longest, asked.want.every);
    }
    const std::string text = format_duration(shortest);
    return longest > shortest ? text + " to " + format_duration(longest) : text;
}

std::string text_of(const Poll& poll, const Scope& scope) {
    const std::string text = "read " + poll.station + ' ' + scope.first->notation;
    if (scope.first->want.span.first != scope.last->want.span.first)
        return text + " to " + scope.last->notation;
    return text + " (" + std::to_string(scope.first->want.span.count) + ')';
}

/// Of what may at most be left for the dearest read.
double left_for(const Dearest& dearest, const LinePlan& plan) {
    return std::min(kHigh - plan.load, kFull - plan.most) + dearest.load;
}

/// The least factor with which it is enough, in tenths and not below `first`; 0 = there is none.
int tenths_of(const Line& line, int first) {
    const auto enough = [&](int tenths) { return is_enough(at_intervals(line, tenths / 10.0)); };
    int low = first - 1;
    int high = first;
    while (!enough(high)) {
        if (high >= kMostTenths) return 0;
        low = high;
        high = std::min(2 * high, kMostTenths);
    }
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        (enough(middle) ? high : low) = middle;
    }
    return high;
}

bool reaches_slowest(const Line& line) {
    const auto is_slowest = [](Duration every) { return every >= points::kSlowest; };
    return std::ranges::any_of(line.relays, is_slowest, &Relay::every) ||
           std::ranges::any_of(line.stations, [&](const Station& station) {
               return std::ranges::any_of(
                   station.asked, [&](const Asked& asked) { return is_slowest(asked.want.every); });
           });
}

/// What a reader of "all intervals" might take for one, or could not set.
std::string exceptions_of(const Line& line) {
    std::string text;
    if (reaches_slowest(line)) text = "24h at most";
    const auto has_refresh = [](const Relay& relay) { return relay.to && relay.refresh; };
    if (std::ranges::any_of(line.relays, has_refresh))
        text += std::string(text.empty() ? "" : ", ") + "refresh as it is";
    return text.empty() ? text : " (" + text + ')';
}

}  // namespace

std::optional<Change> dearest_read_rarer(const Line& line, const LinePlan& plan) {
    const Dearest dearest = dearest_of(plan);
    if (dearest.load <= 0) return std::nullopt;
    const Duration now = dearest.first->every;
    const Duration rarest = std::min<Duration>(kRarest * now, points::kSlowest);
    const double left = left_for(dearest, plan);
    if (left * kRarest < dearest.load) return std::nullopt;
    const Scope scope = scope_of(line, *dearest.first);
    Duration every = rounded_up(std::chrono::duration_cast<Duration>(
        std::chrono::duration<double>(to_seconds(dearest.wire) / left)));
    for (; every <= rarest; every = rounded_up(every + every / 20)) {
        if (every <= now) continue;
        Line made = with(line, scope, every);
        if (!is_enough(made)) continue;
        return Change{text_of(*dearest.first, scope) + " every " + format_duration(every) +
                          " instead of " + intervals_of(line, scope, every),
                      std::move(made)};
    }
    return std::nullopt;
}

std::optional<Change> all_rarer(const Line& line, const LinePlan& plan) {
    const double least = std::max(plan.load / kHigh, plan.most / kFull);  // nothing shrinks faster
    if (least * 10 > kMostTenths) return std::nullopt;
    const int tenths = tenths_of(line, std::max(11, static_cast<int>(std::ceil(least * 10))));
    if (tenths == 0) return std::nullopt;
    Line made = at_intervals(line, tenths / 10.0);
    const std::string besides = exceptions_of(made);
    return Change{"all intervals " + number_text(tenths / 10.0) + " times as long" + besides,
                  std::move(made)};
}

}  // namespace panelgate::plan
