#include "panelgate/plan/line_plan.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/points/settings.hpp"
#include "panelgate/points/station_polls.hpp"
#include "panelgate/profile/notation.hpp"
#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::plan {

namespace {

Duration times_as_long(Duration every, double times) {
    const double made = std::round(static_cast<double>(every.count()) * times);
    const double most = static_cast<double>(points::kSlowest.count());
    return Duration(static_cast<Duration::rep>(std::clamp(made, 1.0, most)));
}

/// Returns the silence after the station's replies.
Duration gap_of(const Line& line, const Station& station) {
    return station.frame_gap.value_or(profile::automatic_gap(line.serial, *station.profile));
}

/// Returns the limits and costs of the station's reads on this line.
points::PlanLimits limits_of(const Line& line, const Station& station) {
    points::PlanLimits limits =
        points::make_plan_limits(*station.profile, line.serial, gap_of(line, station));
    limits.think_time = station.think_time;
    return limits;
}

double share(Duration wire, Duration every) { return to_seconds(wire) / to_seconds(every); }

/// Returns the first item in the notation of the configuration.
std::string notation_of(const Station& station, const points::PlannedRead& read) {
    for (const std::size_t index : read.wants) {
        const PolledItem& asked = station.asked[index];
        if (asked.want.span.first == read.span.first) return asked.notation;
    }
    return profile::format_notation(*station.profile, read.span.table,
                                    static_cast<std::uint16_t>(read.span.first));
}

/// A station's reads as the poller will plan them.
struct Planned {
    points::PlanLimits limits;
    std::vector<points::PlannedRead> reads;
};

Planned planned(const Line& line, const Station& station) {
    std::vector<points::Want> wants;
    for (const PolledItem& asked : station.asked) wants.push_back(asked.want);
    Planned made{limits_of(line, station), {}};
    made.reads = points::plan_reads(wants, made.limits);
    return made;
}

void add_polls(const Station& station, const Planned& planned, std::vector<Poll>& polls) {
    for (const points::PlannedRead& read : planned.reads) {
        Poll& poll = polls.emplace_back();
        poll.station = station.name;
        poll.read = notation_of(station, read);
        poll.count = read.span.count;
        poll.every = read.every;
        poll.wire = points::read_cost(planned.limits, read.span.table, read.span.count);
        poll.load = share(poll.wire, poll.every);
    }
}

RelayLoad load_by(const Relay& relay, const Station& station, RelayLoad::Request request,
                  Duration wire, Duration every) {
    return {relay.name,
            station.name,
            request,
            every,
            wire,
            share(wire, every),
            share(wire, relay.every)};
}

RelayLoad read_of(const Line& line, const Relay& relay) {
    const Station& station = line.stations[relay.from->station];
    const modbus::Span& span = relay.from->span;
    const Duration wire = points::read_cost(limits_of(line, station), span.table, span.count);
    return load_by(relay, station, RelayLoad::Request::read, wire, relay.every);
}

RelayLoad write_of(const Line& line, const Relay& relay) {
    const Station& station = line.stations[relay.to->station];
    const modbus::Span& span = relay.to->span;
    const Duration wire =
        points::write_cost(limits_of(line, station), span.table, span.count, relay.single);
    return load_by(relay, station, RelayLoad::Request::write, wire, relay.writes_every());
}

/// Returns nullopt if no poll of the target shows what is written.
std::optional<RelayLoad> rereads_of(const Station& station, const Planned& planned,
                                    const Relay& relay) {
    Duration wire{};
    Duration least{};  // between two of the station's extra turns
    for (const points::PlannedRead& read : planned.reads) {
        if (points::leaves_unchanged(station.memory, relay.to->span, read.span)) continue;
        wire += points::read_cost(planned.limits, read.span.table, read.span.count);
        least += points::PollSchedule::Settings().extra_every;
    }
    if (wire == Duration::zero()) return std::nullopt;
    const Duration every = relay.writes_every();
    RelayLoad made = load_by(relay, station, RelayLoad::Request::reread, wire, every);
    made.load = share(wire, std::max(every, least));
    made.most = share(wire, std::max(relay.every, least));
    return made;
}

/// Returns the load of one station's polls and relays.
double load_of(const LinePlan& plan, const std::string& station) {
    double load = 0;
    for (const Poll& poll : plan.polls) load += poll.station == station ? poll.load : 0;
    for (const RelayLoad& relay : plan.relays) load += relay.station == station ? relay.load : 0;
    return load;
}

/// Returns the cost of a station's first failure: a response timeout (P4) with the request and the
/// gap, and the suspension while all wait for a late reply.
Duration outage_of(const Line& line, const Station& station) {
    const Duration once = frame_time(line.serial, modbus::kReadRequestAdu) +
                          station.response_timeout + gap_of(line, station);
    if (station.line_rest == Duration::zero()) return once;
    return once + station.line_rest + (station.repeats ? once : Duration::zero());
}

std::optional<OneDead> worst_case(const Line& line, const LinePlan& plan) {
    std::optional<OneDead> worst;
    if (line.listens) return worst;
    Duration holds{};
    for (const Station& station : line.stations) {
        const double load = plan.load - load_of(plan, station.name) + kProbes;
        holds = std::max(holds, outage_of(line, station));
        if (!worst || load > worst->load) worst = OneDead{station.name, load, {}};
    }
    if (worst) worst->holds = holds;
    return worst;
}

Duration client_read(const Line& line) {
    constexpr auto kTable = modbus::Table::holding_registers;
    points::PlanLimits unlisted;
    unlisted.serial = line.serial;
    unlisted.gap = silent_interval(line.serial);
    Duration longest = points::read_cost(unlisted, kTable, kClientRead);
    for (const Station& station : line.stations)
        longest =
            std::max(longest, points::read_cost(limits_of(line, station), kTable, kClientRead));
    return longest;
}

}  // namespace

Line at_intervals(const Line& line, double times) {
    Line made = line;
    for (Station& station : made.stations) {
        for (PolledItem& asked : station.asked)
            asked.want.every = times_as_long(asked.want.every, times);
    }
    for (Relay& relay : made.relays) relay.every = times_as_long(relay.every, times);
    return made;
}

std::string_view label(RelayLoad::Request request) {
    if (request == RelayLoad::Request::read) return "read";
    return request == RelayLoad::Request::write ? "write" : "reread";
}

Verdict verdict(const LinePlan& plan) {
    if (plan.load > kFull) return Verdict::overload;
    return plan.load > kHigh || plan.most > kFull ? Verdict::high : Verdict::fine;
}

bool is_high_by_changes(const LinePlan& plan) { return plan.load <= kHigh && plan.most > kFull; }

LinePlan make_plan(const Line& line) {
    LinePlan plan;
    plan.line = line.name;
    plan.listens = line.listens;
    std::vector<Planned> stations;
    for (const Station& station : line.stations) {
        stations.push_back(planned(line, station));
        add_polls(station, stations.back(), plan.polls);
    }
    for (const Relay& relay : line.relays) {
        if (relay.from) plan.relays.push_back(read_of(line, relay));
        if (!relay.to) continue;
        plan.relays.push_back(write_of(line, relay));
        const std::size_t to = relay.to->station;
        auto rereads = rereads_of(line.stations[to], stations[to], relay);
        if (rereads) plan.relays.push_back(*std::move(rereads));
    }
    for (const Poll& poll : plan.polls) {
        plan.load += poll.load;
        plan.once += poll.wire;
    }
    plan.most = plan.load;
    for (const RelayLoad& relay : plan.relays) {
        plan.load += relay.load;
        plan.most += relay.most;
        if (relay.request != RelayLoad::Request::reread) plan.once += relay.wire;
    }
    plan.dead = worst_case(line, plan);
    plan.client_read = client_read(line);
    return plan;
}

namespace {

constexpr int kDoublings = 40;
constexpr int kHalvings = 24;

LinePlan at(const Line& line, double times) { return make_plan(at_intervals(line, 1 / times)); }

/// Assumes that all loads are proportional to the rate.
double proportional_rate(const LinePlan& plan) {
    return std::min(kHigh / plan.load, kFull / std::max(plan.most, plan.load));
}

/// Needed with relays: a refresh or the limit of extra turns makes loads not proportional.
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
    HighestRate found{proportional_rate(plan), false};
    if (!line.relays.empty()) found.times = search(line, found.times);
    const LinePlan then = at(line, found.times);
    found.changing = then.most / kFull > then.load / kHigh;
    return found;
}

}  // namespace panelgate::plan
