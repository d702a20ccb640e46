// Rules for one address.

#include <optional>

#include "rules.hpp"

namespace panelgate::doctor {

using arbiter::Symptoms;

namespace {

/// True if only this station's replies are damaged: at its rate of damage the others would have had
/// at least five (0.7 % chance of none), but have had a fifth of the expected number, or less.
/// False if only long replies are damaged and no other station has any: that may be the line.
/// `left`: its damaged replies that no late reply of another station explains.
bool only_this_is_damaged(const Case& c, const Bar& bar, const Symptoms& s, std::uint64_t left) {
    const std::uint64_t others_answered = c.all.answered - s.answered;
    const std::uint64_t others_damaged = c.all.damaged() - s.damaged();
    const std::uint64_t own = s.answered + s.damaged();
    const std::uint64_t expected = others_answered * s.damaged();  // in parts of `own`
    const bool hit = left >= bar.enough(3) && left * 100 >= s.answered;
    const bool others_fine =
        expected >= bar.enough(5) * own && others_damaged * 5 * own <= expected;
    const bool only_long =
        s.long_damaged == s.damaged() && c.all.long_answered < s.long_answered + 5;
    return hit && others_fine && !only_long;
}

/// True if its replies are damaged at least twice as often as the others', if there are any.
bool is_damaged_more(const Case& c, const Symptoms& s) {
    const std::uint64_t others = c.all.answered + c.all.damaged() - s.answered - s.damaged();
    const std::uint64_t others_damaged = c.all.damaged() - s.damaged();
    return s.damaged() * others >= 2 * others_damaged * (s.answered + s.damaged());
}

void add_duplicate(Case& c, std::uint8_t station, const Symptoms& s) {
    const std::string address = std::to_string(station);
    const bool twice = s.doubled * 2 >= s.answered && s.doubled > 0;
    const bool others_are_fine =
        c.all.answered > s.answered && c.all.damaged() == s.damaged() && c.all.doubled == s.doubled;
    Figures figures = damage_figures(s);
    figures["doubled"] = s.doubled;
    c.add(Cause::duplicate_address, station, "Two panels seem to have the address " + address + ".",
          std::string("Take the panel off the line: when the address still answers, find the other "
                      "one and change it. If no panel answers, ") +
              (twice ? "this panel or a repeater sends everything twice: set its "
                       "`timing.frame_gap` so long that the second reply has passed."
                     : "look at this panel's cable and communication settings."),
          std::to_string(s.doubled) + " replies came twice; " + damage_text(c, s) +
              (others_are_fine ? "; the other stations are fine" : ""),
          std::move(figures));
}

/// True if replies are too long but begin rightly: a second sender, not a cable fault.
bool has_second_sender(const Bar& bar, const Symptoms& s) {
    return s.damaged_long >= bar.enough(3) && s.damaged_long * 4 >= s.damaged() &&
           s.damaged_heads * 4 >= s.damaged();
}

/// Adds damage of one panel alone: its cable, transceiver or settings.
void add_damage(Case& c, std::uint8_t station, const Symptoms& s) {
    const std::string name = station_text(c, station);
    const std::string evidence = damage_text(c, s) + "; the other stations are fine";
    const bool always = s.damaged() >= 5 && s.answered * 10 <= s.damaged();
    const Cause cause = always ? cause_of_damage(c, s) : Cause::noise;
    const std::string line = " to those of the line (" + to_string(c.facts.serial) + ").";
    if (!c.facts.over_tcp && cause == Cause::wrong_parity)
        return c.add(cause, station, "All replies of " + name + " have wrong bytes.",
                     "Set this panel's parity and data bits" + line, evidence, damage_figures(s));
    if (!c.facts.over_tcp && cause == Cause::wrong_baud)
        return c.add(cause, station, "All that " + name + " sends is not Modbus at this speed.",
                     "Set this panel's baud" + line, evidence, damage_figures(s));
    c.add(
        Cause::damaged_replies, station, "Only the replies of " + name + " are damaged.",
        "Look at this panel's terminals, its branch of the cable and its shield; if the damage "
        "goes with the panel to another place, its transceiver is faulty" +
            std::string(always ? ", or its communication settings differ from the others'." : "."),
        evidence, damage_figures(s));
}

}  // namespace

void find_duplicate_address(Case& c, std::uint8_t station, const Symptoms& s) {
    const bool line = c.has_of_line(Cause::wrong_baud) || c.has_of_line(Cause::wrong_parity) ||
                      c.has(Cause::echo);
    // Another master that reads the same makes replies come twice.
    const bool masters =
        c.has(Cause::other_master) && (s.unasked + c.all.requests) * 2 >= s.doubled;
    if (station == 0 || line || masters || explained_by_frames(c, station)) return;
    const Bar bar{c, Cause::duplicate_address, station};
    const std::uint64_t left = beyond(s.damaged(), unheard_late_replies(c, station));
    const bool mixed = s.doubled >= 1 && left >= bar.enough(3) && is_damaged_more(c, s);
    // A reply that comes after its timeout is taken for the retry's, and the retry's own follows.
    const bool from_retries = s.silent >= s.doubled && s.doubled * 4 < s.answered;
    if ((s.doubled >= bar.enough(3) && !from_retries) || mixed) return add_duplicate(c, station, s);
    // A connection that stalls truncates replies without a second panel.
    if (c.facts.over_tcp && s.damaged_short * 2 > s.damaged()) return;
    if (!only_this_is_damaged(c, {c, Cause::damaged_replies, station}, s, left)) return;
    has_second_sender(bar, s) ? add_duplicate(c, station, s) : add_damage(c, station, s);
}

namespace {

/// Above this, a single reply may have set the maximum: no timeout is derived from it.
constexpr Duration kClustered = 2s;

/// A quarter more than needed, in steps of 10 ms.
Duration enough_for(Duration lateness) { return (lateness * 5 / 4 + 10ms - 1ns) / 10ms * 10ms; }

std::string timeout_advice(const LineFacts& facts, Duration timeout, Duration lateness) {
    if (lateness > kClustered)
        return "Find out what the panel does for so long; when it always needs it, raise its "
               "`timing.response_timeout` (now " +
               duration_text(timeout) + ") and `queue.deadline` (now " +
               duration_text(facts.deadline) + ").";
    const Duration advised = enough_for(timeout + lateness);
    const std::string both = advised < facts.deadline ? "."
                                                      : ", and `queue.deadline` above that (now " +
                                                            duration_text(facts.deadline) + ").";
    return "Set its `timing.response_timeout` to " + duration_text(advised) + both;
}

}  // namespace

/// One late reply, or another master's reply that looks like it, says nothing about the timeout.
void find_short_timeout(Case& c, std::uint8_t station, const Symptoms& s) {
    const Bar bar{c, Cause::timeout_too_short, named(station)};
    if (s.late < bar.enough(3) || c.has(Cause::other_master)) return;
    const std::uint64_t one_in = s.worst_lateness <= kClustered ? 10 : 2;
    if (s.late * one_in * (bar.low ? 2 : 1) < s.attempts()) return;
    const auto found = c.facts.response_timeouts.find(station);
    const Duration timeout =
        found == c.facts.response_timeouts.end() ? c.facts.response_timeout : found->second;
    Figures figures{{"late", s.late},
                    {"in_time", s.answered},
                    {"lateness_ms", whole_ms(s.worst_lateness)},
                    {"timeout_ms", whole_ms(timeout)}};
    const Duration advised = enough_for(timeout + s.worst_lateness);
    if (s.worst_lateness <= kClustered) figures["advised_ms"] = whole_ms(advised);
    if (s.worst_lateness > kClustered || advised >= c.facts.deadline)
        figures["deadline_ms"] = whole_ms(c.facts.deadline);
    c.add(Cause::timeout_too_short, named(station),
          "The replies of " + station_text(c, station) + " come after the response timeout.",
          timeout_advice(c.facts, timeout, s.worst_lateness),
          std::to_string(s.late) + " replies came up to " + duration_text(s.worst_lateness) +
              " after the timeout of " + duration_text(timeout) + "; " +
              std::to_string(s.answered) + " in time",
          std::move(figures));
}

namespace {

struct GapSplit {
    Duration below{};  ///< pauses shorter than this are too short
    std::uint64_t silent_below = 0, answered_below = 0;
    std::uint64_t silent_above = 0, answered_above = 0;
};

/// Finds a pause below which at least half of the requests stay unanswered, and above which hardly
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
    // Only silences count after which the same read, asked again, was answered. A station that is
    // also silent otherwise has another fault.
    std::uint64_t heard_again = 0;
    for (const std::uint64_t count : s.silent_after) heard_again += count;
    if (heard_again * 2 < s.silent) return;
    // A late reply to the first attempt answers the second one, too.
    if (c.has(Cause::timeout_too_short, station) ||
        s.late * 2 >= std::max<std::uint64_t>(1, s.silent))
        return;
    const auto split = split_by_pause({c, Cause::gap_too_short, named(station)}, s);
    if (!split) return;
    // Users of slow panels report 10 to 40 ms; if that is not enough, it is doubled.
    const Duration advised = std::max<Duration>(10ms, 2 * split->below);
    c.add(Cause::gap_too_short, named(station),
          "Requests right after another frame are lost on " + station_text(c, station) + ".",
          "Set its `timing.frame_gap` to " + duration_text(advised) + ".",
          share_text(
              split->silent_below, split->silent_below + split->answered_below,
              ("requests after less than " + duration_text(split->below) + " of silence").c_str()) +
              " were not answered, after longer silence " +
              share_text(split->silent_above, split->silent_above + split->answered_above,
                         "requests"),
          {{"silent_below", split->silent_below},
           {"requests_below", split->silent_below + split->answered_below},
           {"below_ms", whole_ms(split->below)},
           {"silent_above", split->silent_above},
           {"requests_above", split->silent_above + split->answered_above},
           {"advised_ms", whole_ms(advised)}});
}

/// An exception is only recognised by its own function (AP 7): an unsolicited frame may carry any.
void find_wrong_exception(Case& c, std::uint8_t station, const Symptoms& s) {
    const Bar bar{c, Cause::wrong_exception, named(station)};
    if (s.wrong_exceptions < bar.enough(3) || s.wrong_exceptions * 2 < s.wrong) return;
    c.add(Cause::wrong_exception, named(station),
          "What " + station_text(c, station) +
              " refuses, it refuses with the number of another function.",
          "Such an exception cannot be distinguished from an unsolicited frame, so clients get "
          "exception 0B. Ask it only for what it has; with its profile, `guard: true` refuses the "
          "rest here, with the right code. Newer firmware may answer as the standard says.",
          share_text(s.wrong_exceptions, s.attempts(), "requests") +
              " were answered with an exception that names another function; " +
              std::to_string(s.answered) + " replies were right",
          {{"refusals", s.wrong_exceptions}, {"requests", s.attempts()}, {"right", s.answered}});
}

void find_broadcast_replies(Case& c, std::uint8_t station, const Symptoms& s) {
    const Bar bar{c, Cause::answers_broadcasts, named(station)};
    if (s.broadcast_replies < bar.enough(3) || s.broadcast_replies * 4 < c.window.broadcasts)
        return;
    const std::string name = station_text(c, station, true);
    c.add(Cause::answers_broadcasts, named(station),
          name + " answers broadcasts, which no station may (serial line V1.02, 2.1).",
          "Its replies run into those of other panels that do the same, and into the next request "
          "where they take longer than `timing.broadcast_turnaround`: make that long enough, or "
          "write to each station by itself.",
          std::to_string(s.broadcast_replies) + " replies to " +
              std::to_string(c.window.broadcasts) + " broadcasts",
          {{"replies", s.broadcast_replies}, {"broadcasts", c.window.broadcasts}});
}

/// Good frames of the asked station that do not answer the request: the wire is fine.
void find_wrong_reply(Case& c, std::uint8_t station, const Symptoms& s) {
    const Bar bar{c, Cause::wrong_reply, named(station)};
    const bool masters = c.has(Cause::other_master) && s.wrong <= c.all.requests;
    if (s.wrong < bar.enough(3) || s.wrong * 20 < s.answered || masters) return;
    if (c.has(Cause::wrong_exception, station)) return;
    const std::string name = station_text(c, station, true);
    c.add(Cause::wrong_reply, named(station),
          name + " answers with frames that do not fit the request.",
          "Compare the line's trace with the panel's manual: another function, length or address "
          "than was asked comes back. Another function or a shorter read may be what it can do.",
          share_text(s.wrong, s.attempts(), "requests") + " were answered so, " +
              std::to_string(s.answered) + " rightly",
          {{"wrong", s.wrong}, {"requests", s.attempts()}, {"right", s.answered}});
}

/// Late replies, duplicates, another master's replies and those of a second panel are excluded.
void find_unasked_frames(Case& c, std::uint8_t station, const Symptoms& s) {
    if (station == 0 || s.attempts() == 0 || c.has(Cause::other_master) || c.has(Cause::echo) ||
        c.has(Cause::duplicate_address, station))
        return;
    const Bar bar{c, Cause::unasked_frames, station};
    const std::uint64_t frames = s.unasked - std::min(s.unasked, s.wrong);
    if (frames < bar.enough(5) || frames * (bar.low ? 40 : 20) < s.attempts()) return;
    c.add(Cause::unasked_frames, station,
          station_text(c, station, true) + " sends unsolicited frames.",
          c.window.broadcasts > 0
              ? "It may answer broadcasts, which no panel should (serial line V1.02, 2.1), or send "
                "by itself: look for that in its settings."
              : "Look in its settings for what it sends by itself.",
          std::to_string(frames) + " good frames that belong to no request, " +
              std::to_string(s.attempts()) + " requests to it and " +
              std::to_string(c.window.broadcasts) + " broadcasts",
          {{"frames", frames}, {"requests", s.attempts()}, {"broadcasts", c.window.broadcasts}});
}

void find_silent_station(Case& c, std::uint8_t station, const Symptoms& s) {
    if (station == 0 || c.has(Cause::no_answer_at_all) || s.attempts() == 0) return;
    const Bar bar{c, Cause::station_silent, station};
    if (c.has(Cause::wrong_reply, station) || c.has(Cause::wrong_exception, station)) return;
    if (c.has(Cause::timeout_too_short, station) || s.mute_in_a_row < bar.enough(5)) return;
    bool other_answers = false;
    for (const auto& [id, other] : c.window.stations) {
        const bool lately = bar.low || other.mute_in_a_row == 0;
        other_answers = other_answers || (id != station && other.answered > 0 && lately);
    }
    if (!other_answers) return;
    const bool by_crc = s.answered == 0 && !c.facts.crc_high_first.contains(station) &&
                        c.facts.serial.mode == SerialMode::rtu;
    c.add(Cause::station_silent, station,
          station_text(c, station, true) + " does not answer; others do.",
          std::string("The line is fine: check this panel's power, its address and its plug.") +
              (by_crc ? " An Autonics GP with firmware of before June 2005 is silent until its "
                        "`crc_order: high_first` is set."
                      : ""),
          "the last " + std::to_string(s.mute_in_a_row) + " requests to it without a reply",
          {{"requests", s.mute_in_a_row}});
}

}  // namespace panelgate::doctor
