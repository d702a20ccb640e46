#include "panelgate/plan/warnings.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "panelgate/yaml/map_reader.hpp"
#include "rounded_up.hpp"

namespace panelgate::plan {
namespace {

using yaml::format_milliseconds;

constexpr std::size_t kNamed = 3;  // stations of one warning

bool is_asked(const LinePlan& plan, const Station& station) {
    const auto is_its = [&](const auto& request) { return request.station == station.name; };
    return std::ranges::any_of(plan.polls, is_its) || std::ranges::any_of(plan.relays, is_its);
}

/// From the end of a request to the start of its reply: silence tells the panel that it has ended.
Duration answers_after(const Line& line, const Station& station) {
    return silent_interval(line.serial) + station.think_time;
}

bool is_too_late(const Line& line, const Station& station) {
    return answers_after(line, station) > station.response_timeout;
}

std::string named(const std::vector<std::string>& names) {
    std::string all;
    for (std::size_t i = 0; i < std::min(names.size(), kNamed); ++i)
        all += (i == 0 ? "'" : ", '") + names[i] + '\'';
    if (names.size() > kNamed) all += " and " + std::to_string(names.size() - kNamed) + " more";
    return all;
}

/// One for all stations that are alike.
void warn_of_timeouts(const Line& line, const LinePlan& plan, std::vector<std::string>& told) {
    std::map<std::pair<Duration, Duration>, std::vector<std::string>> alike;
    for (const Station& station : line.stations) {
        if (is_asked(plan, station) && is_too_late(line, station))
            alike[{station.think_time, station.response_timeout}].push_back(station.name);
    }
    for (const auto& [times, names] : alike) {
        const auto& [think, timeout] = times;
        const Duration after = silent_interval(line.serial) + think;
        told.push_back(
            "line " + line.name + ": think_time " + yaml::format_duration(think) + " of " +
            named(names) + " makes replies begin " + format_milliseconds(after) +
            " after a request, above the response_timeout of " + yaml::format_duration(timeout) +
            ": each poll and relay there would time out; set response_timeout above " +
            format_milliseconds(after) + ", or think_time lower where the panel is quicker");
    }
}

/// A request that goes out again and again, and whose items could be fewer.
struct Transaction {
    std::string what;
    Duration wire{};
    const Poll* poll = nullptr;  ///< nothing: of a relay
};

std::vector<Transaction> longest_two(const LinePlan& plan) {
    std::vector<Transaction> all;
    for (const Poll& poll : plan.polls) {
        all.push_back({"the poll of " + poll.station + ' ' + poll.read + " (count " +
                           std::to_string(poll.count) + ')',
                       poll.wire, &poll});
    }
    for (const RelayLoad& relay : plan.relays) {
        if (relay.request == RelayLoad::Request::reread) continue;  // polls
        all.push_back({"the " + std::string(label(relay.request)) + " of relay " + relay.relay,
                       relay.wire, nullptr});
    }
    std::ranges::sort(all, std::ranges::greater(),
                      [](const Transaction& one) { return std::pair(one.wire, one.what); });
    all.resize(std::min<std::size_t>(all.size(), 2));
    return all;
}

/// Items of a block with which its read takes no longer; 0 where it is none, or none would do.
std::uint32_t most_items(const Line& line, const Poll& poll, Duration within) {
    const auto station = std::ranges::find(line.stations, poll.station, &Station::name);
    if (poll.asked.size() != 1) return 0;
    const points::PlanLimits limits = limits_of(line, *station);
    const modbus::Table table = station->asked[poll.asked.front()].want.span.table;
    std::uint32_t most = poll.count;
    while (most > 0 && points::read_cost(limits, table, most) > within) --most;
    return most;
}

void warn_of_deadline(const Line& line, const LinePlan& plan, std::vector<std::string>& told) {
    const std::vector<Transaction> longest = longest_two(plan);
    if (longest.empty()) return;
    const Duration before = longest.size() > 1 ? longest[1].wire : Duration::zero();
    const Duration both = longest[0].wire + before;
    if (both <= line.deadline) return;
    std::string warning = "line " + line.name + ": " + longest[0].what + " takes " +
                          format_milliseconds(longest[0].wire) + " at " + to_string(line.serial);
    if (longest.size() > 1)
        warning += ", and " + longest[1].what + ' ' + format_milliseconds(before);
    warning += longest.size() > 1 ? ": one behind the other they miss" : ": it misses";
    warning += " the queue's deadline of " + yaml::format_duration(line.deadline) +
               "; set queue: {deadline: " + yaml::format_duration(rounded_up(both)) + '}';
    const Poll* poll = longest[0].poll;
    const std::uint32_t most =
        poll == nullptr ? 0 : most_items(line, *poll, line.deadline - before);
    if (most > 0) warning += ", or read at most " + std::to_string(most) + " at once";
    told.push_back(std::move(warning));
}

}  // namespace

std::vector<std::string> warnings(const Line& line, const LinePlan& plan) {
    std::vector<std::string> told;
    warn_of_timeouts(line, plan, told);
    if (told.empty()) warn_of_deadline(line, plan, told);  // else think times are in the way
    return told;
}

}  // namespace panelgate::plan
