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

/// True if requests come back at this one of several stations, and at no other.
bool is_only_repeater(const Case& c, std::uint8_t station, const Symptoms& s) {
    const Bar bar{c, Cause::repeats_requests, station};
    const std::uint64_t elsewhere = c.all.echoes - s.echoes;
    const std::uint64_t others = c.all.answered - s.answered;
    const bool often = s.echoes * (bar.low ? 40 : 20) >= s.attempts();
    return s.echoes >= bar.enough(3) && often && others >= 20 && elsewhere * 10 <= s.echoes;
}

void add_duplicate(Case& c, std::uint8_t station, const Symptoms& s) {
    const std::string address = std::to_string(station);
    const bool twice = s.doubled * 2 >= s.answered && s.doubled > 0;
    const bool others_are_fine =
        c.all.answered > s.answered && c.all.damaged() == s.damaged() && c.all.doubled == s.doubled;
    Figures figures = damage_figures(s);
    const std::uint64_t came = s.doubled > 0 ? s.doubled : s.unasked;
    figures["doubled"] = came;
    c.add(Cause::duplicate_address, station, "Two panels seem to have the address " + address + ".",
          std::string("Take the panel off the line: when the address still answers, find the other "
                      "one and change it. If no panel answers, ") +
              (twice ? "this panel or a repeater sends everything twice: set its "
                       "`timing.frame_gap` so long that the second reply has passed."
                     : "look at this panel's cable and communication settings."),
          std::to_string(came) +
              (s.doubled > 0 ? " replies came twice; " : " frames came beside the replies; ") +
              damage_text(c, s) + (others_are_fine ? "; the other stations are fine" : ""),
          std::move(figures));
}

/// Returns how many repeated replies have another cause: what comes unasked, instead of the right
/// reply, to a broadcast, or from a panel with a wrong address, may have the form of the last
/// reply.
std::uint64_t explained_copies(const Case& c, std::uint8_t station, const Symptoms& s) {
    // Frames that came instead of the reply are counted as unasked, too.
    std::uint64_t explained = misaddressed_elsewhere(c, station) + std::max(s.unasked, s.wrong);
    if (c.has(Cause::answers_broadcasts, station)) explained += c.window.broadcasts;
    return explained;
}

/// True if replies are too long but begin rightly: a second sender, or bytes too many.
bool may_have_second_sender(const Symptoms& s) {
    return s.damaged_long >= 3 && s.damaged_long * 4 >= s.damaged() &&
           s.damaged_heads * 4 >= s.damaged();
}

std::string damage_advice(const Symptoms& s, bool always) {
    std::string advice =
        "Look at this panel's terminals, its branch of the cable and its shield; if the damage "
        "goes with the panel to another place, its transceiver is faulty";
    advice += always ? ", or its communication settings differ from the others'." : ".";
    if (may_have_second_sender(s))
        advice +=
            " Replies are longer than asked: if its address still answers when it is off the "
            "line, a second panel has it.";
    if (loses_beginnings(s)) advice = std::string(kLostBeginnings) + " " + advice;
    return advice;
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
    c.add(Cause::damaged_replies, station, "Only the replies of " + name + " are damaged.",
          damage_advice(s, always), evidence, damage_figures(s));
}

}  // namespace

std::uint64_t misaddressed_elsewhere(const Case& c, std::uint8_t except) {
    return 2 * (c.all.misaddressed - c.window.stations.at(except).misaddressed);
}

void find_duplicate_address(Case& c, std::uint8_t station, const Symptoms& s) {
    // Another master that reads the same makes replies come twice.
    const bool masters =
        c.has(Cause::other_master) && (s.unasked + c.all.requests) * 2 >= s.doubled;
    // A second panel answers each request once, at most: more than that comes by itself.
    const std::uint64_t beside = beyond(s.unasked, s.wrong + misaddressed_elsewhere(c, station));
    const bool by_itself = s.doubled + beside > s.attempts();
    if (station == 0 || masters) return;
    const Bar bar{c, Cause::duplicate_address, station};
    const std::uint64_t twice = beyond(s.doubled, explained_copies(c, station, s));
    const std::uint64_t left = beyond(s.damaged(), unheard_late_replies(c, station));
    const bool mixed = twice >= 1 && left >= bar.enough(3) && is_damaged_more(c, s);
    // A reply that comes after its timeout is taken for the retry's, and the retry's own follows.
    const bool from_retries = s.silent >= twice && twice * 4 < s.answered;
    const bool often = twice >= bar.enough(3) && !from_retries;
    // Two answers that differ, and others that have run into each other.
    const bool both = beside >= bar.enough(3) && left >= bar.enough(3) &&
                      may_have_second_sender(s) && is_damaged_more(c, s);
    if (both || (!by_itself && (often || mixed))) add_duplicate(c, station, s);
}

void find_damage(Case& c, std::uint8_t station, const Symptoms& s) {
    if (station == 0) return;
    const std::uint64_t left = beyond(s.damaged(), unheard_late_replies(c, station));
    // A connection that stalls truncates replies without a fault of the panel.
    const std::uint64_t cut = beyond(s.damaged_short, s.beheaded);
    if (c.facts.over_tcp && cut * 2 > s.damaged()) return;
    if (only_this_is_damaged(c, {c, Cause::damaged_replies, station}, s, left))
        add_damage(c, station, s);
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
    const std::uint64_t late = s.late;
    const std::uint64_t owed = s.attempts() - s.answered;
    if (late < bar.enough(3) || late > 2 * owed) return;  // no more replies than were owed are late
    const std::uint64_t one_in = s.worst_lateness <= kClustered ? 10 : 2;
    if (late * one_in * (bar.low ? 2 : 1) < s.attempts()) return;
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
    if (s.late * 2 >= std::max<std::uint64_t>(1, s.silent)) return;
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
    // What comes by itself now and then comes in place of a reply, too.
    const bool by_itself = beyond(s.unasked, s.wrong) >= s.wrong;
    const std::uint64_t wrong = (by_itself ? 0 : s.wrong) + s.misaddressed;
    const bool masters = c.has(Cause::other_master) && wrong <= c.all.requests;
    if (wrong < bar.enough(3) || wrong * 20 < s.answered || masters) return;
    const std::string name = station_text(c, station, true);
    const bool elsewhere = s.misaddressed > s.wrong;
    c.add(Cause::wrong_reply, named(station),
          name + (elsewhere ? " answers with the address of another station."
                            : " answers with frames that do not fit the request."),
          elsewhere
              ? "See in the line's trace which address answers when it is asked, and give the "
                "panel its own."
              : "Compare the line's trace with the panel's manual: another function, length or "
                "address than was asked comes back. Another function or a shorter read may be what "
                "it can do; registers of 4 or 12 bytes need `any_length: true`.",
          share_text(wrong, s.attempts(), "requests") + " were answered so, " +
              std::to_string(s.answered) + " rightly",
          {{"wrong", wrong}, {"requests", s.attempts()}, {"right", s.answered}});
}

/// Late replies, duplicates, another master's replies and those of a second panel are excluded.
void find_unasked_frames(Case& c, std::uint8_t station, const Symptoms& s) {
    if (station == 0) return;
    const Bar bar{c, Cause::unasked_frames, station};
    std::uint64_t others = s.wrong + misaddressed_elsewhere(c, station);
    if (c.has(Cause::answers_broadcasts, station)) others += c.window.broadcasts;
    const std::uint64_t frames = beyond(s.unasked, others);
    if (frames < bar.enough(5) || frames * (bar.low ? 40 : 20) < s.attempts()) return;
    std::string advice = "Look in its settings for what it sends by itself.";
    if (c.window.broadcasts > 0)
        advice =
            "It may answer broadcasts, which no panel should (serial line V1.02, 2.1), or "
            "send by itself: look for that in its settings.";
    if (s.attempts() == 0)
        advice += " Or another master asks it whose requests are not heard here.";
    c.add(Cause::unasked_frames, station,
          station_text(c, station, true) + " sends unsolicited frames.", advice,
          std::to_string(frames) + " good frames that belong to no request, " +
              std::to_string(s.attempts()) + " requests to it and " +
              std::to_string(c.window.broadcasts) + " broadcasts",
          {{"frames", frames}, {"requests", s.attempts()}, {"broadcasts", c.window.broadcasts}});
}

/// All that comes back comes at one of several stations: no adapter, and no second sender. Others
/// may have collided meanwhile, where the echo was waited for.
void find_repeated_requests(Case& c, std::uint8_t station, const Symptoms& s) {
    if (station == 0 || !is_only_repeater(c, station, s)) return;
    c.add(
        Cause::repeats_requests, station,
        station_text(c, station, true) + " sends requests back, before its reply or in its place.",
        "Set `echo: off` if no adapter of this line hears what it sends; then look at the "
        "panel's converter and its settings.",
        share_text(s.echoes, s.attempts(), "requests to it") +
            " came back, and hardly any to the others",
        {{"echoes", s.echoes}, {"requests", s.attempts()}});
}

/// It is silent now and then, and seldom twice in a row, also to what it answers at other times.
void find_missed_requests(Case& c, std::uint8_t station, const Symptoms& s) {
    const Bar bar{c, Cause::misses_requests, named(station)};
    const std::uint64_t runs = s.silences;
    const bool now_and_then = runs >= bar.enough(10) && s.silent <= 3 * runs;
    const bool often = s.silent * (bar.low ? 10 : 5) >= s.attempts();
    if (!now_and_then || !often || s.repeated * 10 < runs || s.late * 2 >= s.silent) return;
    c.add(Cause::misses_requests, named(station),
          station_text(c, station, true) + " answers only some of the requests to it.",
          "Ask it less often, or set a longer `timing.frame_gap`; if that changes nothing, look at "
          "its branch of the cable and what else keeps it busy: a panel does not answer a request "
          "that arrives damaged.",
          share_text(s.silent, s.attempts(), "requests") + " were not answered; " +
              std::to_string(s.repeated) + " of them were when they were asked again",
          {{"silent", s.silent}, {"requests", s.attempts()}, {"repeated", s.repeated}});
}

void find_silent_station(Case& c, std::uint8_t station, const Symptoms& s) {
    if (station == 0) return;
    const Bar bar{c, Cause::station_silent, station};
    const bool elsewhere = s.misaddressed * 4 >= s.silent + s.disturbed && s.misaddressed > 0;
    if (s.mute_in_a_row < bar.enough(5) || elsewhere) return;
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
