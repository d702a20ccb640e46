// What concerns one address.

#include <optional>

#include "rules.hpp"

namespace panelgate::doctor {

using arbiter::Symptoms;

namespace {

std::optional<std::uint8_t> named(std::uint8_t station) {
    if (station == 0) return std::nullopt;
    return station;
}

/// The others would have had five damaged replies if the line damaged theirs as often (none by
/// chance: 0.7 %), and have had a fifth of that at most. When only long replies are hit and nobody
/// else has any, the line may be it nevertheless.
bool only_this_is_damaged(const Case& c, const Bar& bar, const Symptoms& s) {
    const std::uint64_t others_answered = c.all.answered - s.answered;
    const std::uint64_t others_damaged = c.all.damaged() - s.damaged();
    const std::uint64_t own = s.answered + s.damaged();
    const std::uint64_t expected = others_answered * s.damaged();  // in parts of `own`
    const bool hit = s.damaged() >= bar.enough(3) && s.damaged() * 20 >= s.answered;
    const bool others_fine =
        expected >= bar.enough(5) * own && others_damaged * 5 * own <= expected;
    const bool unfair = s.long_damaged == s.damaged() && c.all.long_answered < s.long_answered + 5;
    return hit && others_fine && !unfair;
}

void add_duplicate(Case& c, std::uint8_t station, const Symptoms& s) {
    c.add(Cause::duplicate_address, station,
          "Two panels seem to have the address " + std::to_string(station) + ".",
          "Take the panel off the line: when the address still answers, find the other one and "
          "change it. If nobody answers, look at this panel's cable and communication settings.",
          std::to_string(s.doubled) + " replies came twice; " + damage_text(c, s) +
              "; the other stations are fine");
}

}  // namespace

void find_duplicate_address(Case& c, std::uint8_t station, const Symptoms& s) {
    const bool line = c.has(Cause::wrong_baud) || c.has(Cause::wrong_parity) || c.has(Cause::echo);
    const bool masters = c.has(Cause::other_master) && s.unasked * 2 >= s.doubled;
    if (station == 0 || line || masters) return;
    const Bar bar{c, Cause::duplicate_address, station};
    const bool mixed = s.doubled >= 1 && s.damaged() >= bar.enough(3);
    if (s.doubled >= bar.enough(3) || mixed) return add_duplicate(c, station, s);
    if (!only_this_is_damaged(c, bar, s)) return;
    const bool always = s.damaged() >= 5 && s.answered * 10 <= s.damaged();
    if (!always || cause_of_damage(c, s) != Cause::wrong_parity)
        return add_duplicate(c, station, s);
    c.add(Cause::wrong_parity, station,
          "All replies of station " + std::to_string(station) + " have wrong bytes.",
          "Set this panel's parity and data bits to those of the line (" +
              to_string(c.facts.serial) + ").",
          damage_text(c, s));
}

void find_short_timeout(Case& c, std::uint8_t station, const Symptoms& s) {
    const Bar bar{c, Cause::timeout_too_short, named(station)};
    if (s.late < bar.enough(3)) return;
    const auto found = c.facts.response_timeouts.find(station);
    const Duration timeout =
        found == c.facts.response_timeouts.end() ? c.facts.response_timeout : found->second;
    // A quarter more than what was needed, in steps of 10 ms.
    const Duration needed = (timeout + s.worst_lateness) * 5 / 4;
    const Duration advised = (needed + 10ms - 1ns) / 10ms * 10ms;
    c.add(Cause::timeout_too_short, named(station),
          "The replies of " + station_text(station) + " come after the response timeout.",
          "Set its `timing.response_timeout` to " + duration_text(advised) + ".",
          std::to_string(s.late) + " replies came up to " + duration_text(s.worst_lateness) +
              " after the timeout of " + duration_text(timeout) + "; " +
              std::to_string(s.answered) + " in time");
}

namespace {

struct GapSplit {
    Duration below{};  ///< pauses shorter than this are too short
    std::uint64_t silent_below = 0, answered_below = 0;
    std::uint64_t silent_above = 0, answered_above = 0;
};

/// A pause below which half of the requests and more stay without reply, and from which on hardly
/// any do.
std::optional<GapSplit> split_by_pause(const Bar& bar, const Symptoms& s) {
    GapSplit split;
    split.below = 2ms;  // upper end of the first class of pauses
    for (std::size_t i = 0; i < Symptoms::kPauses; ++i) {
        split.silent_above += s.silent_after[i];
        split.answered_above += s.answered_after[i];
    }
    for (std::size_t i = 0; i + 1 < Symptoms::kPauses; ++i, split.below *= 2) {
        split.silent_below += s.silent_after[i];
        split.answered_below += s.answered_after[i];
        split.silent_above -= s.silent_after[i];
        split.answered_above -= s.answered_after[i];
        const bool closely_silent =
            split.silent_below >= bar.enough(5) && split.silent_below >= split.answered_below;
        const bool else_answers = split.answered_above >= bar.enough(5) &&
                                  split.silent_above * 10 <= split.answered_above;
        if (closely_silent && else_answers) return split;
    }
    return std::nullopt;
}

}  // namespace

void find_short_gap(Case& c, std::uint8_t station, const Symptoms& s) {
    // A late reply to the first attempt answers the second one, too.
    if (c.has(Cause::timeout_too_short, station) ||
        s.late * 2 >= std::max<std::uint64_t>(1, s.silent))
        return;
    const auto split = split_by_pause({c, Cause::gap_too_short, named(station)}, s);
    if (!split) return;
    // Users of slow panels report 10 to 40 ms; from there on it is doubled until it suffices.
    const Duration advised = std::max<Duration>(10ms, 2 * split->below);
    c.add(Cause::gap_too_short, named(station),
          "Requests right behind another frame are lost on " + station_text(station) + ".",
          "Set its `timing.frame_gap` to " + duration_text(advised) + ".",
          share_text(
              split->silent_below, split->silent_below + split->answered_below,
              ("requests after less than " + duration_text(split->below) + " of silence").c_str()) +
              " were not answered, after longer silence " +
              share_text(split->silent_above, split->silent_above + split->answered_above,
                         "requests"));
}

void find_silent_station(Case& c, std::uint8_t station, const Symptoms& s) {
    if (station == 0 || c.has(Cause::no_answer_at_all) || s.attempts() == 0) return;
    const Bar bar{c, Cause::station_silent, station};
    if (c.has(Cause::timeout_too_short, station) || s.mute_in_a_row < bar.enough(5)) return;
    bool other_answers = false;
    for (const auto& [id, other] : c.window.stations) {
        const bool lately = bar.low || other.mute_in_a_row == 0;
        other_answers = other_answers || (id != station && other.answered > 0 && lately);
    }
    if (!other_answers) return;
    c.add(Cause::station_silent, station,
          "Station " + std::to_string(station) + " does not answer; others do.",
          "The line is fine: check this panel's power, its address and its plug.",
          "the last " + std::to_string(s.mute_in_a_row) + " requests to it without a reply");
}

}  // namespace panelgate::doctor
