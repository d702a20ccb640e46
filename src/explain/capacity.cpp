#include "panelgate/explain/capacity.hpp"

#include <algorithm>
#include <boost/json/array.hpp>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "panelgate/arbiter/learned.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/explain/translations.hpp"
#include "panelgate/plan/line_plan.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::explain {

namespace {

plan::Station station_of(const config::Line& line, const config::Station& station,
                         const arbiter::StationSettings& settings) {
    plan::Station made;
    made.name = station.name;
    made.profile = station.profile;
    made.response_timeout = settings.response_timeout;
    made.think_time = station.think_time;
    made.station_gap = settings.station_gap;
    made.after_write = settings.after_write;
    made.repeats = settings.retries > 0;
    if (line.arbiter.quarantine == arbiter::Quarantine::line)
        made.line_rest =
            arbiter::LateWindow(settings.late_window, settings.response_timeout).value();
    if (!station.automatic_gap) made.frame_gap = settings.frame_gap;
    made.memory = memory_of(station.profile);
    const auto wants = points::wants_of(station.points, station.polls);
    for (std::size_t i = 0; i < wants.size() && !line.listens; ++i) {
        const bool point = i < station.points.size();
        made.asked.push_back({wants[i], point ? station.points[i].at
                                              : station.polls[i - station.points.size()].read});
    }
    return made;
}

/// Returns the relay's end on the line; nothing if the relay's end is on another line.
std::optional<plan::Relay::End> end_of(const plan::Line& line, const points::RelayEnd& end,
                                       std::uint32_t count) {
    const auto found = std::ranges::find(line.stations, end.station, &plan::Station::name);
    if (found == line.stations.end()) return std::nullopt;
    const auto index = static_cast<std::size_t>(found - line.stations.begin());
    return plan::Relay::End{index, {end.table, end.address, count}};
}

plan::Relay relay_of(const plan::Line& line, const points::Relay& relay) {
    plan::Relay made;
    made.name = relay.name();
    made.every = relay.every;
    if (relay.on_change) made.refresh = relay.refresh;
    made.from = end_of(line, relay.from, relay.count);
    made.to = end_of(line, relay.to, relay.count);
    made.single = made.to && relay.count == 1 &&
                  !takes_multiple(*line.stations[made.to->station].profile, relay.to.table);
    return made;
}

plan::Line line_of(const config::Config& config, const config::Line& line) {
    plan::Line made;
    made.name = line.name;
    made.serial = line.device.serial;
    made.listens = line.listens;
    made.deadline = line.arbiter.queue.deadline;
    for (std::size_t i = 0; i < line.stations.size(); ++i)
        made.stations.push_back(station_of(line, line.stations[i], line.arbiter.stations[i]));
    for (const points::Relay& relay : config.relays) {
        plan::Relay one = relay_of(made, relay);
        if (one.from || one.to) made.relays.push_back(std::move(one));
    }
    return made;
}

}  // namespace

std::vector<Capacity> capacities(const config::Config& config) {
    std::vector<Capacity> all;
    for (const config::Line& line : config.lines) {
        Capacity& made = all.emplace_back();
        made.line = line_of(config, line);
        made.plan = plan::make_plan(made.line);
        made.advice = plan::advise(made.line, made.plan);
        made.warnings = plan::warnings(made.line, made.plan);
    }
    return all;
}

namespace {

namespace json = boost::json;

double rounded(double value) { return std::round(value * 1000) / 1000; }
double percent(double load) { return rounded(100 * load); }
double rounded_ms(Duration time) { return rounded(1000 * to_seconds(time)); }

json::object poll_json(const plan::Poll& poll) {
    return {{"station", poll.station},
            {"read", poll.read},
            {"count", poll.count},
            {"every_ms", rounded_ms(poll.every)},
            {"wire_ms", rounded_ms(poll.wire)},
            {"load_percent", percent(poll.load)}};
}

json::object relay_json(const plan::RelayLoad& relay) {
    return {{"relay", relay.relay},
            {"station", relay.station},
            {"request", plan::label(relay.request)},
            {"every_ms", rounded_ms(relay.every)},
            {"wire_ms", rounded_ms(relay.wire)},
            {"load_percent", percent(relay.load)},
            {"most_percent", percent(relay.most)}};
}

json::object highest_rate_json(const Capacity& capacity) {
    json::object made{{"once_ms", rounded_ms(capacity.plan.once)}};
    if (const auto highest = plan::highest_rate(capacity.line, capacity.plan)) {
        made["times_as_often"] = rounded(highest->times);
        made["limited_by"] = highest->changing ? "most_percent" : "load_percent";
    }
    return made;
}

std::string_view word(plan::Verdict verdict) {
    switch (verdict) {
        case plan::Verdict::fine:
            return "fine";
        case plan::Verdict::high:
            return "high";
        case plan::Verdict::overload:
            return "overload";
    }
    std::abort();
}

}  // namespace

void add_plan(json::object& line, const Capacity& capacity) {
    const plan::LinePlan& plan = capacity.plan;
    json::array polls;
    for (const plan::Poll& poll : plan.polls) polls.push_back(poll_json(poll));
    json::array relays;
    for (const plan::RelayLoad& relay : plan.relays) relays.push_back(relay_json(relay));
    json::array advice;
    if (capacity.advice)
        advice.push_back(json::object{{"what", capacity.advice->what},
                                      {"load_percent", percent(capacity.advice->load)},
                                      {"most_percent", percent(capacity.advice->most)}});
    line["load_percent"] = percent(plan.load);
    line["most_percent"] = percent(plan.most);
    line["verdict"] = word(plan::verdict(plan));
    line["polls"] = std::move(polls);
    line["relays"] = std::move(relays);
    if (plan.dead) {
        line["one_dead"] = json::object{{"station", plan.dead->station},
                                        {"load_percent", percent(plan.dead->load)},
                                        {"holds_ms", rounded_ms(plan.dead->holds)}};
    }
    line["highest_rate"] = highest_rate_json(capacity);
    line["headroom"] = json::object{{"load_percent", percent(plan.free_share())},
                                    {"reads_per_second", rounded(plan.free_reads())}};
    line["advice"] = std::move(advice);
}

namespace {

using yaml::format_duration;

constexpr const char* kChanging = " while values change";

std::string rounded_text(double value) { return number_text(std::round(value * 10) / 10); }
std::string percent_text(double load) { return rounded_text(100 * load) + " %"; }
std::string milliseconds_text(Duration time) {
    return rounded_text(1000 * to_seconds(time)) + "ms";
}

std::string text_of(const plan::Poll& poll) {
    return "  asks " + poll.station + ' ' + poll.read + ", count " + std::to_string(poll.count) +
           ", every " + format_duration(poll.every) + ": " + milliseconds_text(poll.wire) + ", " +
           percent_text(poll.load) + '\n';
}

std::string text_of(const plan::RelayLoad& relay) {
    std::string text = "  relay " + relay.relay + ": " + std::string(label(relay.request)) +
                       " of " + relay.station + " every " + format_duration(relay.every) + ": " +
                       milliseconds_text(relay.wire) + ", " + percent_text(relay.load);
    if (relay.most > relay.load) text += ", " + percent_text(relay.most) + kChanging;
    return text + '\n';
}

std::string text_of(const plan::OneDead& dead) {
    return "  with " + dead.station + " dead: " + percent_text(dead.load) +
           " at most; a station that falls silent holds the others up for " +
           milliseconds_text(dead.holds) + ", once\n";
}

std::string headroom_of(const Capacity& capacity) {
    const plan::LinePlan& plan = capacity.plan;
    std::string text = "  left for clients: " + percent_text(plan.free_share()) + ", " +
                       rounded_text(plan.free_reads()) + " reads of " +
                       std::to_string(plan::kClientRead) + " registers a second\n";
    if (const auto highest = plan::highest_rate(capacity.line, plan)) {
        text += "  highest rate: all of this " + rounded_text(highest->times) +
                " times as often, up to " +
                (highest->changing ? percent_text(plan::kFull) + kChanging
                                   : percent_text(plan::kHigh)) +
                "; once through takes " + milliseconds_text(plan.once) + '\n';
    }
    return text;
}

/// The load that decides comes first: the certain one, or the one while values change.
std::string text_of(const plan::Advice& advice, bool changing) {
    std::string text = advice.what + " brings ";
    if (changing) return text + percent_text(advice.most) + kChanging;
    text += percent_text(advice.load);
    if (advice.most > advice.load) text += " (" + percent_text(advice.most) + kChanging + ')';
    return text;
}

}  // namespace

std::string plan_text(const Capacity& capacity) {
    const plan::LinePlan& plan = capacity.plan;
    std::string text = "plan of line " + plan.line + ", " + to_string(capacity.line.serial) + ": " +
                       percent_text(plan.load) + " of its time";
    if (plan.most > plan.load) text += ", " + percent_text(plan.most) + kChanging;
    text += '\n';
    for (const plan::Poll& poll : plan.polls) text += text_of(poll);
    for (const plan::RelayLoad& relay : plan.relays) text += text_of(relay);
    if (plan.listens) return text + "  it only listens: nothing is ever sent there\n";
    if (plan.dead) text += text_of(*plan.dead);
    text += headroom_of(capacity);
    if (capacity.advice)
        text += "  advice: " + text_of(*capacity.advice, plan::is_high_by_changes(plan)) + '\n';
    return text;
}

std::string overload_text(const Capacity& capacity) {
    const plan::LinePlan& plan = capacity.plan;
    const bool changing = plan::is_high_by_changes(plan);
    std::string text = "line " + plan.line + " is planned to be busy for " +
                       percent_text(changing ? plan.most : plan.load) + " of its time at " +
                       to_string(capacity.line.serial);
    if (plan::verdict(plan) == plan::Verdict::overload) {
        text += ": polls will be late for ever";
    } else if (changing) {
        text += std::string(kChanging) +
                " that relays copy: they will arrive late, and clients wait long";
    } else {
        text += ": above " + percent_text(plan::kHigh) + " clients wait long";
    }
    return capacity.advice ? text + "; " + text_of(*capacity.advice, changing) : text;
}

}  // namespace panelgate::explain
