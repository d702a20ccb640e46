#include "capacity.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>

#include "panelgate/arbiter/late_window.hpp"
#include "wiring.hpp"

namespace panelgate::app {
namespace {

plan::Station station_of(const config::Line& line, const config::Station& station,
                         const arbiter::StationSettings& settings) {
    plan::Station made;
    made.name = station.name;
    made.profile = station.profile;
    made.response_timeout = settings.response_timeout;
    made.think_time = station.think_time;
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

/// Nothing on another line.
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

}  // namespace panelgate::app
