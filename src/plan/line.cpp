#include "panelgate/plan/line.hpp"

#include <algorithm>
#include <cmath>

#include "panelgate/points/settings.hpp"
#include "panelgate/profile/frame_gap.hpp"

namespace panelgate::plan {
namespace {

Duration times_as_long(Duration every, double times) {
    const double made = std::round(static_cast<double>(every.count()) * times);
    const double most = static_cast<double>(points::kSlowest.count());
    return Duration(static_cast<Duration::rep>(std::clamp(made, 1.0, most)));
}

bool follows(const Relay::End& end, const Relay::End& next) {
    return end.station == next.station && end.span.table == next.span.table &&
           end.span.end() == next.span.first;
}

}  // namespace

bool Relay::continues_in(const Relay& other) const {
    if (!from || !to || !other.from || !other.to) return false;
    return every == other.every && refresh == other.refresh && !single &&
           follows(*from, *other.from) && follows(*to, *other.to);
}

Duration gap_of(const Line& line, const Station& station) {
    return station.frame_gap.value_or(profile::automatic_gap(line.serial, *station.profile));
}

points::PlanLimits limits_of(const Line& line, const Station& station) {
    points::PlanLimits limits =
        points::make_plan_limits(*station.profile, line.serial, gap_of(line, station));
    limits.think_time = station.think_time;
    return limits;
}

Line at_rate(const Line& line, int baud) {
    Line made = line;
    made.serial.baud = baud;
    return made;
}

Line at_intervals(const Line& line, double times) {
    Line made = line;
    for (Station& station : made.stations) {
        for (Asked& asked : station.asked)
            asked.want.every = times_as_long(asked.want.every, times);
    }
    for (Relay& relay : made.relays) relay.every = times_as_long(relay.every, times);
    return made;
}

}  // namespace panelgate::plan
