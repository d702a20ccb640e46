#include "panelgate/plan/line.hpp"

#include <algorithm>

namespace panelgate::plan {
namespace {

/// Gaps of up to four characters (Panasonic GT; the standard has 3.5) come of the rate, and so does
/// the standard's; a longer one is what a panel needs, at any rate.
Duration gap_at(Duration gap, const SerialFormat& now, const SerialFormat& then) {
    const Duration least = silent_interval(then);
    if (gap == silent_interval(now)) return least;
    const bool of_characters = gap <= wire_time(now, 4);
    return std::max(least, of_characters ? gap * now.baud / then.baud : gap);
}

bool follows(const Relay::End& end, const Relay::End& next) {
    return end.station == next.station && end.span.table == next.span.table &&
           end.span.end() == next.span.first;
}

}  // namespace

bool Relay::continues_in(const Relay& other) const {
    if (!from || !to || !other.from || !other.to) return false;
    return every == other.every && writes_every == other.writes_every && !single &&
           follows(*from, *other.from) && follows(*to, *other.to);
}

points::PlanLimits limits_of(const Line& line, const Station& station) {
    points::PlanLimits limits =
        points::make_plan_limits(*station.profile, line.serial, station.gap);
    limits.think_time = station.think_time;
    return limits;
}

Line at_rate(const Line& line, int baud) {
    Line made = line;
    made.serial.baud = baud;
    for (Station& station : made.stations)
        station.gap = gap_at(station.gap, line.serial, made.serial);
    return made;
}

}  // namespace panelgate::plan
