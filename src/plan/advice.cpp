#include "panelgate/plan/advice.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/base/text.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/plan/line_plan.hpp"
#include "panelgate/points/settings.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::plan {

/// A possible change, and the changed line.
struct Change {
    std::string what;
    Line line;
};

/// A higher rate: the lowest that is enough, else the highest that all panels support.
std::optional<Change> higher_baud(const Line& line);
/// A longer interval for the costliest read only, if that is enough with less than ten times the
/// interval. Applies to everything asked of this station from the read's first item to its last.
std::optional<Change> slow_costliest_read(const Line& line, const LinePlan& plan);
/// One factor on all intervals; a relay's refresh stays.
std::optional<Change> slow_all_intervals(const Line& line, const LinePlan& plan);
/// One relay instead of several. Points and poll blocks are joined anyway.
std::optional<Change> merge_relays(const Line& line);

namespace {

/// True if the panel supports this read in one request, within one area.
bool can_read(const Line& line, const Relay::End& end) {
    const Station& station = line.stations[end.station];
    const profile::Area* area = station.profile->find_area(end.span.table, end.span.first);
    return area != nullptr && area->readable.contains(end.span.first, end.span.count) &&
           end.span.count <= limits_of(line, station).of(end.span.table).max_items;
}

bool can_write(const Line& line, const Relay::End& end) {
    const profile::PanelProfile& panel = *line.stations[end.station].profile;
    const profile::Area* area = panel.find_area(end.span.table, end.span.first);
    const auto function = modbus::is_bit_table(end.span.table) ? modbus::kWriteMultipleCoils
                                                               : modbus::kWriteMultipleRegisters;
    return area != nullptr && area->writable &&
           area->writable->contains(end.span.first, end.span.count) &&
           end.span.count <= panel.max_count(function);
}

/// True if a relay reads from this station: joining relays that write to it could close a circle.
bool is_relay_source(const Line& line, std::size_t station) {
    return std::ranges::any_of(line.relays, [&](const Relay& relay) {
        return relay.from && relay.from->station == station;
    });
}

/// Returns one relay instead of both, if possible.
std::optional<Relay> merged(const Line& line, const Relay& a, const Relay& b) {
    if (!a.continues_in(b) || is_relay_source(line, a.to->station)) return std::nullopt;
    Relay both = a;
    both.from->span.count += b.from->span.count;
    both.to->span.count += b.to->span.count;
    if (!can_read(line, *both.from) || !can_write(line, *both.to)) return std::nullopt;
    return both;
}

/// Merges the first two relays that can be merged; returns false if there are none.
bool merge_first_pair(Line& line, std::string& which) {
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

}  // namespace

std::optional<Change> merge_relays(const Line& line) {
    Line made = line;
    std::string which;
    while (merge_first_pair(made, which)) {
    }
    if (which.empty()) return std::nullopt;
    return Change{"one relay instead of " + which, std::move(made)};
}

namespace {

constexpr std::array kRates{2400, 4800, 9600, 19200, 38400, 57600, 115200};

bool all_have(const Line& line, int baud) {
    return std::ranges::all_of(line.stations, [&](const Station& station) {
        return profile::allows(station.profile->serial.baud, baud);
    });
}

}  // namespace

std::optional<Change> higher_baud(const Line& line) {
    std::optional<Change> found;
    for (const int baud : kRates) {
        if (baud <= line.serial.baud || !all_have(line, baud)) continue;
        found = Change{"serial: {baud: " + std::to_string(baud) + "} (of all panels, too)",
                       at_rate(line, baud)};
        if (verdict(make_plan(found->line)) == Verdict::fine) break;
    }
    return found;
}

namespace {

using yaml::format_duration;

constexpr int kMaxReadFactor = 10;  // factor, for one read alone
constexpr int kMaxTenths = 10'000;  // factor for all intervals, in tenths

bool is_enough(const Line& line) { return verdict(make_plan(line)) == Verdict::fine; }

/// Reads with the same wants: several if a block is cut.
struct CostliestRead {
    const Poll* first = nullptr;
    Duration wire{};
    double load = 0;
};

CostliestRead costliest_read_of(const LinePlan& plan) {
    std::map<std::pair<std::string, std::vector<std::size_t>>, CostliestRead> reads;
    for (const Poll& poll : plan.polls) {
        CostliestRead& sum = reads[{poll.station, poll.asked}];
        if (sum.first == nullptr) sum.first = &poll;
        sum.wire += poll.wire;
        sum.load += poll.load;
    }
    const auto costliest =
        std::ranges::max_element(reads, {}, [](const auto& entry) { return entry.second.load; });
    return costliest == reads.end() ? CostliestRead() : costliest->second;
}

/// What a read serves, as a range of one station's items.
struct Scope {
    std::size_t station = 0;
    const PolledItem* first = nullptr;
    const PolledItem* last = nullptr;

    bool contains(const PolledItem& asked) const {
        const modbus::Span& span = asked.want.span;
        return span.table == first->want.span.table && span.first >= first->want.span.first &&
               span.first <= last->want.span.first;
    }
};

Scope scope_of(const Line& line, const Poll& poll) {
    const auto station = std::ranges::find(line.stations, poll.station, &Station::name);
    Scope scope{static_cast<std::size_t>(station - line.stations.begin()), nullptr, nullptr};
    for (const std::size_t index : poll.asked) {
        const PolledItem& asked = station->asked[index];
        const std::uint32_t at = asked.want.span.first;
        if (scope.first == nullptr || at < scope.first->want.span.first) scope.first = &asked;
        if (scope.last == nullptr || at > scope.last->want.span.first) scope.last = &asked;
    }
    return scope;
}

Line with(const Line& line, const Scope& scope, Duration every) {
    Line made = line;
    for (PolledItem& asked : made.stations[scope.station].asked) {
        if (scope.contains(asked)) asked.want.every = std::max(asked.want.every, every);
    }
    return made;
}

/// "100ms", or "100ms to 130ms": the current intervals shorter than `every`.
std::string intervals_of(const Line& line, const Scope& scope, Duration every) {
    Duration shortest = every;
    Duration longest{};
    for (const PolledItem& asked : line.stations[scope.station].asked) {
        if (!scope.contains(asked) || asked.want.every >= every) continue;
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

/// Returns the load that the costliest read may have at most.
double budget_for(const CostliestRead& costliest, const LinePlan& plan) {
    return std::min(kHigh - plan.load, kFull - plan.most) + costliest.load;
}

/// Returns the least sufficient factor, in tenths and at least `first`; 0: none.
int least_tenths(const Line& line, int first) {
    const auto enough = [&](int tenths) { return is_enough(at_intervals(line, tenths / 10.0)); };
    int low = first - 1;
    int high = first;
    while (!enough(high)) {
        if (high >= kMaxTenths) return 0;
        low = high;
        high = std::min(2 * high, kMaxTenths);
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
               return std::ranges::any_of(station.asked, [&](const PolledItem& asked) {
                   return is_slowest(asked.want.every);
               });
           });
}

/// Returns what "all intervals" does not include or cannot reach, as text.
std::string remarks_of(const Line& line) {
    std::string text;
    if (reaches_slowest(line)) text = "24h at most";
    const auto has_refresh = [](const Relay& relay) { return relay.to && relay.refresh; };
    if (std::ranges::any_of(line.relays, has_refresh))
        text += std::string(text.empty() ? "" : ", ") + "refresh as it is";
    return text.empty() ? text : " (" + text + ')';
}

}  // namespace

std::optional<Change> slow_costliest_read(const Line& line, const LinePlan& plan) {
    const CostliestRead costliest = costliest_read_of(plan);
    if (costliest.load <= 0) return std::nullopt;
    const Duration now = costliest.first->every;
    const Duration max_every = std::min<Duration>(kMaxReadFactor * now, points::kSlowest);
    const double left = budget_for(costliest, plan);
    if (left * kMaxReadFactor < costliest.load) return std::nullopt;
    const Scope scope = scope_of(line, *costliest.first);
    Duration every = rounded_up(std::chrono::duration_cast<Duration>(
        std::chrono::duration<double>(to_seconds(costliest.wire) / left)));
    for (; every <= max_every; every = rounded_up(every + every / 20)) {
        if (every <= now) continue;
        Line made = with(line, scope, every);
        if (!is_enough(made)) continue;
        return Change{text_of(*costliest.first, scope) + " every " + format_duration(every) +
                          " instead of " + intervals_of(line, scope, every),
                      std::move(made)};
    }
    return std::nullopt;
}

std::optional<Change> slow_all_intervals(const Line& line, const LinePlan& plan) {
    const double least = std::max(plan.load / kHigh, plan.most / kFull);  // no load shrinks faster
    if (least * 10 > kMaxTenths) return std::nullopt;
    const int tenths = least_tenths(line, std::max(11, static_cast<int>(std::ceil(least * 10))));
    if (tenths == 0) return std::nullopt;
    Line made = at_intervals(line, tenths / 10.0);
    const std::string remarks = remarks_of(made);
    return Change{"all intervals " + number_text(tenths / 10.0) + " times as long" + remarks,
                  std::move(made)};
}

std::vector<Advice> advise(const Line& line, const LinePlan& plan) {
    std::vector<Advice> all;
    if (verdict(plan) == Verdict::fine) return all;
    const bool changing = is_high_by_changes(plan);
    const auto judged = [&](const auto& one) { return changing ? one.most : one.load; };
    const auto changes = {higher_baud(line), slow_costliest_read(line, plan),
                          slow_all_intervals(line, plan), merge_relays(line)};
    for (const std::optional<Change>& change : changes) {
        if (!change) continue;
        const LinePlan then = make_plan(change->line);
        if (judged(plan) - judged(then) >= kMinGain)
            all.push_back({change->what, then.load, then.most});
    }
    std::ranges::sort(all, {}, [&](const Advice& one) { return std::pair(judged(one), one.what); });
    return all;
}

namespace {

using yaml::format_milliseconds;

constexpr std::size_t kMaxNamed = 3;  // stations named per warning

bool is_asked(const LinePlan& plan, const Station& station) {
    const auto is_its = [&](const auto& request) { return request.station == station.name; };
    return std::ranges::any_of(plan.polls, is_its) || std::ranges::any_of(plan.relays, is_its);
}

/// Time from the end of a request to the start of its reply: the panel detects the end by silence.
Duration answers_after(const Line& line, const Station& station) {
    return silent_interval(line.serial) + station.think_time;
}

bool is_too_late(const Line& line, const Station& station) {
    return answers_after(line, station) > station.response_timeout;
}

std::string named(const std::vector<std::string>& names) {
    std::string all;
    for (std::size_t i = 0; i < std::min(names.size(), kMaxNamed); ++i)
        all += (i == 0 ? "'" : ", '") + names[i] + '\'';
    if (names.size() > kMaxNamed)
        all += " and " + std::to_string(names.size() - kMaxNamed) + " more";
    return all;
}

/// One warning for all stations with the same times.
void warn_of_timeouts(const Line& line, const LinePlan& plan, std::vector<std::string>& messages) {
    std::map<std::pair<Duration, Duration>, std::vector<std::string>> alike;
    for (const Station& station : line.stations) {
        if (is_asked(plan, station) && is_too_late(line, station))
            alike[{station.think_time, station.response_timeout}].push_back(station.name);
    }
    for (const auto& [times, names] : alike) {
        const auto& [think, timeout] = times;
        const Duration after = silent_interval(line.serial) + think;
        messages.push_back(
            "line " + line.name + ": think_time " + yaml::format_duration(think) + " of " +
            named(names) + " makes replies begin " + format_milliseconds(after) +
            " after a request, above the response_timeout of " + yaml::format_duration(timeout) +
            ": each poll and relay there would time out; set response_timeout above " +
            format_milliseconds(after) + ", or think_time lower where the panel is quicker");
    }
}

/// Returns which part of each second the station is asked or rests; more than 1 cannot be.
double share_with_rests(const LinePlan& plan, const Station& station) {
    const Duration after_write = std::max(station.station_gap, station.after_write);
    double share = 0;
    for (const Poll& poll : plan.polls)
        if (poll.station == station.name)
            share += to_seconds(poll.wire + station.station_gap) / to_seconds(poll.every);
    for (const RelayLoad& relay : plan.relays) {
        if (relay.station != station.name || relay.request == RelayLoad::Request::reread) continue;
        const bool writes = relay.request == RelayLoad::Request::write;
        const Duration rest = writes ? after_write : station.station_gap;
        share += to_seconds(relay.wire + rest) / to_seconds(relay.every);
    }
    return share;
}

void warn_of_rests(const Line& line, const LinePlan& plan, std::vector<std::string>& messages) {
    for (const Station& station : line.stations) {
        if (station.station_gap + station.after_write == Duration::zero()) continue;
        const double share = share_with_rests(plan, station);
        if (share <= 1) continue;
        const double times = std::ceil(share * 10) / 10;
        messages.push_back("line " + line.name + ": with its station_gap and after_write '" +
                           station.name + "' is busy for longer than its polls and relays allow; " +
                           "ask it " + number_text(times) +
                           " times as seldom, or for more items at once");
    }
}

/// A periodic request whose items could be fewer.
struct Transaction {
    std::string what;
    Duration wire{};
    const Poll* poll = nullptr;  ///< null: of a relay
};

std::vector<Transaction> longest_two(const LinePlan& plan) {
    std::vector<Transaction> all;
    for (const Poll& poll : plan.polls) {
        all.push_back({"the poll of " + poll.station + ' ' + poll.read + " (count " +
                           std::to_string(poll.count) + ')',
                       poll.wire, &poll});
    }
    for (const RelayLoad& relay : plan.relays) {
        if (relay.request == RelayLoad::Request::reread) continue;  // already among the polls
        all.push_back({"the " + std::string(label(relay.request)) + " of relay " + relay.relay,
                       relay.wire, nullptr});
    }
    std::ranges::sort(all, std::ranges::greater(),
                      [](const Transaction& one) { return std::pair(one.wire, one.what); });
    all.resize(std::min<std::size_t>(all.size(), 2));
    return all;
}

/// Returns the items of a block whose read takes at most `within`; 0 if not a single block, or none
/// fits.
std::uint32_t most_items(const Line& line, const Poll& poll, Duration within) {
    const auto station = std::ranges::find(line.stations, poll.station, &Station::name);
    if (poll.asked.size() != 1) return 0;
    const points::PlanLimits limits = limits_of(line, *station);
    const modbus::Table table = station->asked[poll.asked.front()].want.span.table;
    std::uint32_t most = poll.count;
    while (most > 0 && points::read_cost(limits, table, most) > within) --most;
    return most;
}

void warn_of_deadline(const Line& line, const LinePlan& plan, std::vector<std::string>& messages) {
    const std::vector<Transaction> longest = longest_two(plan);
    if (longest.empty()) return;
    const Duration before = longest.size() > 1 ? longest[1].wire : Duration::zero();
    const Duration both = longest[0].wire + before;
    if (both <= line.deadline) return;
    std::string warning = "line " + line.name + ": " + longest[0].what + " takes " +
                          format_milliseconds(longest[0].wire) + " at " + to_string(line.serial);
    if (longest.size() > 1)
        warning += ", and " + longest[1].what + ' ' + format_milliseconds(before);
    warning += longest.size() > 1 ? ": one after the other they miss" : ": it misses";
    warning += " the queue's deadline of " + yaml::format_duration(line.deadline) +
               "; set queue: {deadline: " + yaml::format_duration(rounded_up(both)) + '}';
    const Poll* poll = longest[0].poll;
    const std::uint32_t most =
        poll == nullptr ? 0 : most_items(line, *poll, line.deadline - before);
    if (most > 0) warning += ", or read at most " + std::to_string(most) + " at once";
    messages.push_back(std::move(warning));
}

}  // namespace

std::vector<std::string> warnings(const Line& line, const LinePlan& plan) {
    std::vector<std::string> messages;
    warn_of_timeouts(line, plan, messages);
    warn_of_rests(line, plan, messages);
    if (messages.empty())
        warn_of_deadline(line, plan, messages);  // otherwise the think times are at fault
    return messages;
}

}  // namespace panelgate::plan
