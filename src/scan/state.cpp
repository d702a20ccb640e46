#include "state.hpp"

namespace panelgate::scan {

namespace {

constexpr double kCollisionShare =
    0.25;  // share of replies: two panels that answer collide more often
constexpr double kNoise = 0.1;
constexpr double kDamageRatio = 3;  // factor to the damage elsewhere

double damaged_share(const Evidence& seen) {
    return seen.asked == 0 ? 0 : static_cast<double>(seen.damaged) / seen.asked;
}

/// Returns the damaged share of all other stations, without certain duplicates.
double damage_elsewhere(const Result& result, const StationFinding& finding) {
    Evidence all;
    for (const StationFinding& other : result.stations) {
        if (&other == &finding || other.evidence.twice > 0) continue;
        all.asked += other.evidence.asked;
        all.damaged += other.evidence.damaged;
    }
    return damaged_share(all);
}

}  // namespace

void mark_duplicates(Result& result) {
    for (StationFinding& finding : result.stations) {
        const Evidence& seen = finding.evidence;
        const double share = damaged_share(seen);
        const double others = damage_elsewhere(result, finding);
        const bool collides =
            seen.damaged >= 2 && share >= kCollisionShare && share > kDamageRatio * others;
        finding.duplicate = seen.twice > 0 || seen.mixed || collides;
        if (!finding.duplicate && seen.damaged >= 2 && others >= kNoise) result.noisy = true;
    }
}

namespace {

constexpr std::size_t kMaxGlitches = 2;  // bytes to be ignored

}  // namespace

void add_frame(Talk& talk, const Frame& frame) {
    talk[frame.station].insert(modbus::plain_function(frame.pdu[0]));
}

void Scanner::State::listen(TimePoint now, Duration how_long) {
    heard.clear();
    if (listening_at > 0) set_format(now, formats[listening_at]);
    not_before = std::max(not_before, now) + how_long;
}

/// Valid frames: another master. Unreadable bytes: perhaps one in another format. Silence: start.
void Scanner::State::end_listening(TimePoint now) {
    const Heard parts = extract_frames(heard);
    for (const Frame& frame : parts.frames) add_frame(result.talk, frame);
    if (!result.talk.empty()) {
        result.format = format;
        if (listening_at > 0 && !std::exchange(listened_again, true)) {
            not_before = now + settings.listen;  // for other stations
            return;
        }
        if (settings.speak_anyway) return accept_format();
        result.ending = Result::Ending::another_master;
        phase = Phase::done;
        return;
    }
    const bool noise = parts.damaged > kMaxGlitches;
    if (noise) result.noise += static_cast<unsigned>(parts.damaged);
    const bool look_on = noise || listening_at > 0;
    if (look_on && listening_at + 1 < formats.size()) {
        ++listening_at;
        return listen(now, settings.listen_each);
    }
    phase = Phase::searching;
}

}  // namespace panelgate::scan
