#include "duplicates.hpp"

namespace panelgate::scan {
namespace {

constexpr double kCollision = 0.25;  // of the replies: two panels that answer hit more often
constexpr double kNoise = 0.1;
constexpr double kTimes = 3;  // more damage than elsewhere

double damaged_share(const Evidence& seen) {
    return seen.asked == 0 ? 0 : static_cast<double>(seen.damaged) / seen.asked;
}

/// Of all stations but this one and those that surely are two.
double elsewhere(const Result& result, const StationFinding& finding) {
    Evidence all;
    for (const StationFinding& other : result.stations) {
        if (&other == &finding || other.evidence.twice > 0) continue;
        all.asked += other.evidence.asked;
        all.damaged += other.evidence.damaged;
    }
    return damaged_share(all);
}

}  // namespace

void tell_duplicates(Result& result) {
    for (StationFinding& finding : result.stations) {
        const Evidence& seen = finding.evidence;
        const double share = damaged_share(seen);
        const double others = elsewhere(result, finding);
        const bool collides = seen.damaged >= 2 && share >= kCollision && share > kTimes * others;
        finding.duplicate = seen.twice > 0 || seen.mixed || collides;
        if (!finding.duplicate && seen.damaged >= 2 && others >= kNoise) result.noisy = true;
    }
}

}  // namespace panelgate::scan
