#include "panelgate/plan/advice.hpp"

#include <algorithm>
#include <array>
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

namespace {

constexpr std::array kRates{2400, 4800, 9600, 19200, 38400, 57600, 115200};

bool all_have(const Line& line, int baud) {
    return std::ranges::all_of(line.stations, [&](const Station& station) {
        return profile::allows(station.profile->serial.baud, baud);
    });
}

/// The lowest higher rate that is enough, else the highest that all panels support.
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

using yaml::format_duration;

constexpr int kMaxTenths = 10'000;  // factor for all intervals, in tenths

bool is_enough(const Line& line) { return verdict(make_plan(line)) == Verdict::fine; }

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

/// One factor on all intervals; a relay's refresh stays.
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

}  // namespace

std::vector<Advice> advise(const Line& line, const LinePlan& plan) {
    std::vector<Advice> all;
    if (verdict(plan) == Verdict::fine) return all;
    const bool changing = is_high_by_changes(plan);
    const auto judged = [&](const auto& one) { return changing ? one.most : one.load; };
    for (const std::optional<Change>& change :
         {higher_baud(line), slow_all_intervals(line, plan)}) {
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
