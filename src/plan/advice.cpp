#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/base/text.hpp"
#include "panelgate/plan/line_plan.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::plan {
namespace {

using yaml::format_duration;
using yaml::format_milliseconds;

constexpr double kMostTimes = 1000;  // as long: more is no advice

bool all_have(const Line& line, int baud) {
    return std::ranges::all_of(line.stations, [&](const Station& station) {
        return profile::allows(station.profile->serial.baud, baud);
    });
}

Advice made_of(std::string what, const LinePlan& then) {
    return {std::move(what), then.load, then.most};
}

std::optional<Advice> higher_baud(const Line& line) {
    for (const int baud : {2400, 4800, 9600, 19200, 38400, 57600, 115200}) {
        if (baud <= line.serial.baud || !all_have(line, baud)) continue;
        Line quicker = line;
        quicker.serial.baud = baud;
        const LinePlan then = make_plan(quicker);
        if (verdict(then) == Verdict::fine)
            return made_of("serial: {baud: " + std::to_string(baud) + "} (of all panels, too)",
                           then);
    }
    return std::nullopt;
}

std::optional<Advice> longer_intervals(const Line& line, const LinePlan& plan) {
    const auto highest = highest_rate(line, plan);
    if (!highest || highest->times * kMostTimes < 1) return std::nullopt;
    const double times = std::ceil(10 / highest->times) / 10;
    const LinePlan then = make_plan(at_intervals(line, times));
    if (verdict(then) != Verdict::fine) return std::nullopt;  // 24 h are not long enough
    const bool refreshes = std::ranges::any_of(
        line.relays, [](const Relay& relay) { return relay.to && relay.refresh; });
    return made_of("all intervals " + number_text(times) + " times as long" +
                       (refreshes ? " (refresh as it is)" : ""),
                   then);
}

bool is_asked(const LinePlan& plan, const Station& station) {
    const auto is_its = [&](const auto& request) { return request.station == station.name; };
    return std::ranges::any_of(plan.polls, is_its) || std::ranges::any_of(plan.relays, is_its);
}

/// Names the first of the stations whose replies are planned to begin too late.
void warn_of_timeouts(const Line& line, const LinePlan& plan, std::vector<std::string>& messages) {
    std::vector<const Station*> late;
    const Duration silence = silent_interval(line.serial);  // by it the panel knows the end
    for (const Station& station : line.stations) {
        if (is_asked(plan, station) && silence + station.think_time > station.response_timeout)
            late.push_back(&station);
    }
    if (late.empty()) return;
    const Station& first = *late.front();
    const std::string after = format_milliseconds(silence + first.think_time);
    const std::string more =
        late.size() > 1 ? " (and of " + std::to_string(late.size() - 1) + " more)" : "";
    messages.push_back("line " + line.name + ": think_time " + format_duration(first.think_time) +
                       " of '" + first.name + '\'' + more + " makes replies begin " + after +
                       " after a request, above the response_timeout of " +
                       format_duration(first.response_timeout) +
                       ": each poll and relay there would time out; set response_timeout above " +
                       after + ", or think_time lower where the panel is quicker");
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
        messages.push_back("line " + line.name + ": with its station_gap and after_write '" +
                           station.name + "' is busy for longer than its polls and relays allow; " +
                           "ask it " + number_text(std::ceil(share * 10) / 10) +
                           " times as seldom, or for more items at once");
    }
}

/// A periodic request, and its time on the wire.
using Transaction = std::pair<Duration, std::string>;

std::vector<Transaction> longest_first(const LinePlan& plan) {
    std::vector<Transaction> all;
    for (const Poll& poll : plan.polls)
        all.emplace_back(poll.wire, "the poll of " + poll.station + ' ' + poll.read + " (count " +
                                        std::to_string(poll.count) + ')');
    for (const RelayLoad& relay : plan.relays) {
        if (relay.request == RelayLoad::Request::reread) continue;  // already among the polls
        all.emplace_back(relay.wire,
                         "the " + std::string(label(relay.request)) + " of relay " + relay.relay);
    }
    std::ranges::sort(all, std::ranges::greater());
    return all;
}

/// Rounds up to a round number of milliseconds with at most two significant digits.
Duration rounded_up(Duration duration) {
    Duration unit = 1ms;
    while (duration > 20 * unit) unit *= 10;
    return (duration + unit - Duration(1)) / unit * unit;
}

void warn_of_deadline(const Line& line, const LinePlan& plan, std::vector<std::string>& messages) {
    const std::vector<Transaction> longest = longest_first(plan);
    if (longest.empty()) return;
    const bool two = longest.size() > 1;
    const Duration both = longest[0].first + (two ? longest[1].first : Duration::zero());
    if (both <= line.deadline) return;
    std::string text = "line " + line.name + ": " + longest[0].second + " takes " +
                       format_milliseconds(longest[0].first) + " at " + to_string(line.serial);
    if (two) text += ", and " + longest[1].second + ' ' + format_milliseconds(longest[1].first);
    messages.push_back(text + (two ? ": one after the other they miss" : ": it misses") +
                       " the queue's deadline of " + format_duration(line.deadline) +
                       "; set queue: {deadline: " + format_duration(rounded_up(both)) +
                       "}, or read less at once");
}

}  // namespace

std::optional<Advice> advise(const Line& line, const LinePlan& plan) {
    if (verdict(plan) == Verdict::fine) return std::nullopt;
    auto helps = higher_baud(line);
    return helps ? helps : longer_intervals(line, plan);
}

std::vector<std::string> warnings(const Line& line, const LinePlan& plan) {
    std::vector<std::string> messages;
    warn_of_timeouts(line, plan, messages);
    warn_of_rests(line, plan, messages);
    if (messages.empty())
        warn_of_deadline(line, plan, messages);  // otherwise the think times are at fault
    return messages;
}

}  // namespace panelgate::plan
