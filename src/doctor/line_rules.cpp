#include <optional>
#include <string>
#include <vector>

#include "rules.hpp"

namespace panelgate::doctor {

// Rules for the whole line.

using arbiter::Symptoms;

void find_echo(Case& c) {
    const Bar bar{c, Cause::echo};
    if (c.facts.echo == EchoMode::off && c.all.echoes >= bar.enough(3)) {
        c.add(
            Cause::echo, {}, "The adapter hears what it sends, and `echo: off` denies it.",
            "Set `echo: auto` or `echo: on`, or switch the adapter's receiver off while it sends.",
            std::to_string(c.all.echoes) + " requests came back as they were sent",
            {{"echoes", c.all.echoes}});
    }
    if (c.facts.echo == EchoMode::on && c.all.echoes == 0 &&
        c.all.collided + c.all.silent >= bar.enough(5) && c.all.collided >= bar.enough(3)) {
        c.add(Cause::echo, {}, "No request comes back, although `echo: on` says so.",
              "Set `echo: auto` or `echo: off`.",
              "instead of its echo something else followed " +
                  share_text(c.all.collided, c.all.attempts(), "requests"),
              {{"collided", c.all.collided}, {"requests", c.all.attempts()}});
    }
}

/// Negotiation at the start of a connection is telnet (RFC 854) and nothing else: no counts are
/// waited for.
void find_telnet(Case& c) {
    if (!c.window.telnet) return;
    c.add(Cause::telnet, {}, "The device server speaks telnet, which mixes bytes of its own in.",
          "Set its port to raw TCP, without telnet and RFC 2217 (ser2net: accepter `tcp`, not "
          "`telnet(rfc2217)`).",
          "the connection began with telnet's negotiation (FF FB to FF FE)", {});
}

namespace {

std::string silence_advice(const LineFacts& facts) {
    if (facts.serial.baud == SerialFormat::kNoWire)
        return "The TCP connection is up. Check the unit ids, whether the device's Modbus server "
               "is "
               "on, and whether the port speaks RTU over TCP (then write tcp://).";
    if (facts.over_tcp)
        return "The TCP connection is up. Check the server's mode (raw or transparent, not "
               "Modbus/TCP), whether it can open its serial port and no other program uses it, its "
               "baud and parity, the power of the panels and the stations' addresses.";
    return "Check the power of the panels, the wires A and B (swapped?) and their bias, `serial` "
           "(now " +
           to_string(facts.serial) + ") and the stations' addresses.";
}

/// Good frames of stations that are not ours: not listed, and not asked. After a broadcast they may
/// be wrong answers to it, which show no other master.
std::uint64_t foreign_frames(const Case& c) {
    const auto unlisted = c.window.stations.find(0);
    if (c.window.broadcasts > 0 || unlisted == c.window.stations.end()) return 0;
    return unlisted->second.attempts() == 0 ? unlisted->second.unasked : 0;
}

}  // namespace

/// All panels at once: the line, not a panel.
void find_no_answer(Case& c) {
    const Bar bar{c, Cause::no_answer_at_all};
    std::uint64_t mute = 0;
    std::uint64_t stations = 0;
    for (const auto& [id, symptoms] : c.window.stations) {
        if (symptoms.attempts() == 0) continue;
        // A scan of unlisted addresses without a panel says nothing about the line.
        if (id == 0 && symptoms.answered == 0 && c.window.stations.size() > 1) continue;
        if (symptoms.mute_in_a_row < bar.enough(3)) return;
        if (symptoms.wrong * 2 >= symptoms.attempts()) return;  // a wrong reply is still a reply
        mute += symptoms.mute_in_a_row;
        ++stations;
    }
    if (mute < bar.enough(6)) return;
    std::string advice = silence_advice(c.facts);
    std::string evidence = std::to_string(stations) + " station(s) asked, the last " +
                           std::to_string(mute) + " requests without a reply";
    if (c.window.uart && c.window.uart->breaks >= bar.enough(3)) {
        advice =
            "Swap the wires A and B, or give the line a bias: the receiver sees breaks. " + advice;
        evidence += "; the driver counted " + std::to_string(c.window.uart->breaks) + " breaks";
    }
    c.add(Cause::no_answer_at_all, {}, "No station answers on this line.", std::move(advice),
          std::move(evidence), {{"stations", stations}, {"requests", mute}});
}

void find_other_master(Case& c) {
    const Bar bar{c, Cause::other_master};
    const std::uint64_t frames = foreign_frames(c);
    if (c.all.requests + frames < bar.enough(3)) return;
    const bool heard = c.all.requests > 0;
    c.add(Cause::other_master, {},
          heard ? "Another master sends requests on this line."
                : "Stations answer that this gateway did not ask.",
          heard ? "Take the other master (a PLC, a PC, a second gateway) off the line."
                : "Take the other master (a PLC, a PC, a second gateway) off the line; if there is "
                  "none, a panel transmits unasked or with an address that is not its own.",
          std::to_string(c.all.requests) + " requests of another master, " +
              std::to_string(frames) + " frames of stations that were not asked, and " +
              std::to_string(c.all.attempts()) + " requests of this gateway",
          {{"foreign_requests", c.all.requests},
           {"foreign_frames", frames},
           {"requests", c.all.attempts()}});
}

void find_collision(Case& c) {
    const Bar bar{c, Cause::collision};
    if (c.all.collided < bar.enough(3)) return;
    c.add(Cause::collision, {}, "Another device transmits while the gateway does.",
          "Look for another master, for a panel that answers very late, and for a transceiver that "
          "does not release the line.",
          share_text(c.all.collided, c.all.attempts(), "requests") + " came back changed",
          {{"collided", c.all.collided}, {"requests", c.all.attempts()}});
}

void find_overrun(Case& c) {
    const Bar bar{c, Cause::overrun};
    if (!c.window.uart || c.window.uart->overruns < bar.enough(2)) return;
    Figures figures = damage_figures(c.all);
    figures["overruns"] = c.window.uart->overruns;
    c.add(Cause::overrun, {}, "The serial driver lost bytes.",
          "Give the gateway more of the processor, lower `serial.baud`, or use an adapter with a "
          "larger buffer.",
          std::to_string(c.window.uart->overruns) + " overruns; " + damage_text(c, c.all),
          std::move(figures));
}

namespace {

/// True if bytes follow most replies: not frames, as of a second panel.
bool trails(const Case& c, std::uint8_t station, const Symptoms& s) {
    Bar bar{c, Cause::trailing_bytes, named(station)};
    bar.low = bar.low || c.is_standing(Cause::trailing_bytes);
    const std::uint64_t followed = beyond(s.trailed, s.doubled + s.unasked);
    return followed >= bar.enough(5) && followed * (bar.low ? 4 : 2) >= s.answered;
}

void add_trailing(Case& c, std::optional<std::uint8_t> station, const std::string& whose,
                  const Symptoms& s) {
    c.add(Cause::trailing_bytes, station, "Bytes follow the replies of " + whose + ".",
          "Look at when the transceiver stops sending and at the line's bias; if that cannot be "
          "changed, set `timing.frame_gap` so long that they have passed: 10ms, or more if this "
          "finding stays.",
          share_text(s.trailed, s.answered, "replies") + " were followed by more bytes",
          {{"trailed", s.trailed}, {"replies", s.answered}});
}

}  // namespace

void find_trailing_bytes(Case& c) {
    std::vector<std::uint8_t> found;
    std::size_t answering = 0;
    for (const auto& [id, symptoms] : c.window.stations) {
        answering += symptoms.answered > 0 ? 1U : 0U;
        if (trails(c, id, symptoms)) found.push_back(id);
    }
    if (found.size() >= 2 && found.size() == answering)
        return add_trailing(c, {}, "all stations", c.all);
    for (const std::uint8_t id : found)
        add_trailing(c, named(id), station_text(c, id), c.window.stations.at(id));
}

// Damaged replies: of the whole line, or of one panel.

namespace {

/// Nearly all replies are damaged: one in ten may be good by chance.
bool is_all_damaged(const Case& c, const Symptoms& s) {
    const Bar bar{c, cause_of_damage(c, s)};
    return s.damaged() >= bar.enough(5) && s.answered * 10 <= s.damaged();
}

double share(std::uint64_t part, std::uint64_t whole) {
    return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

/// Sums the line's counts, without stations whose damage has another cause.
Symptoms unexplained(const Case& c) {
    Sample rest;
    for (const auto& [id, symptoms] : c.window.stations) {
        const bool explained =
            c.has(Cause::duplicate_address, id) || c.has(Cause::damaged_replies, id) ||
            (id != 0 && c.has(Cause::wrong_baud, id)) ||
            (id != 0 && c.has(Cause::wrong_parity, id)) || explained_by_frames(c, id);
        if (explained) continue;
        Symptoms& own = rest.stations[id] = symptoms;
        if (c.has_of_line(Cause::trailing_bytes) || c.has(Cause::trailing_bytes, id))
            own.strays -= std::min(own.strays, own.trailed);
    }
    return rest.total();
}

/// All of a few damaged replies came from one of several stations: that station, or chance.
bool may_be_one_station(const Case& c, const Symptoms& s) {
    constexpr std::uint64_t kFew = 8;
    if (s.damaged() >= kFew) return false;
    bool one = false, others = false;
    for (const auto& [id, symptoms] : c.window.stations) {
        one = one || symptoms.damaged() == s.damaged();
        others = others || (symptoms.answered > 0 && symptoms.damaged() == 0);
    }
    return one && others;
}

/// One damaged frame in a thousand is normal; one in a hundred is a fault.
bool is_too_often(const Case& c, const Bar& bar, const Symptoms& s, std::uint64_t damaged) {
    return damaged >= bar.enough(3) && (bar.low || !may_be_one_station(c, s)) &&
           share(damaged, damaged + s.answered) >= (bar.low ? 0.003 : 0.01);
}

/// True if long replies are damaged more often than their length explains, as by reflections.
bool hits_long_replies(const Symptoms& s) {
    const std::uint64_t short_damaged = s.damaged() - s.long_damaged;
    const std::uint64_t short_answered = s.answered - s.long_answered;
    constexpr std::uint64_t kEnough = 10;
    return s.long_damaged >= 3 && short_answered >= kEnough &&
           share(s.long_damaged, s.long_damaged + s.long_answered) >
               3 * share(short_damaged, short_damaged + short_answered);
}

/// Good frames that came beside the replies: as many may have met others, and come in pieces.
std::uint64_t surplus_frames(const Case& c) { return c.all.unasked + c.all.doubled; }

/// They come around the replies of one of several stations only: of that panel, not of the line.
bool are_of_one_station(const Case& c, const Symptoms& s) {
    constexpr std::uint64_t kFew = 8;  // of which four fifths of all come by chance
    bool one = false, others = false;
    for (const auto& [id, symptoms] : c.window.stations) {
        const bool most = symptoms.strays * 5 >= s.strays * 4;
        one = one || most;
        others = others || (!most && symptoms.answered >= kFew);
    }
    return one && others;
}

}  // namespace

/// A panel that is never late is off, and none of its replies comes. At least one late reply in
/// kOneIn is heard, also on a busy line: what is unanswered beyond that has another cause.
std::uint64_t unheard_late_replies(const Case& c, std::optional<std::uint8_t> except) {
    constexpr std::uint64_t kOneIn = 20;
    std::uint64_t unheard = 0;
    for (const auto& [id, symptoms] : c.window.stations) {
        if (id == except) continue;
        const std::uint64_t unanswered = symptoms.silent + symptoms.disturbed;
        unheard += std::min(beyond(unanswered, symptoms.late), kOneIn * symptoms.late);
    }
    return unheard;
}

/// The length indicates the rate, and zeros indicate bytes that the parity check has dropped.
Cause cause_of_damage(const Case& c, const Symptoms& s) {
    const bool same_pace = s.damaged_exact * 5 >= s.damaged() * 4;
    // Bytes that pass a wrong parity check all have the same parity; those left by noise have both.
    const std::uint64_t left = s.damaged_bytes - s.damaged_zeros;
    const bool alike = std::min(s.damaged_odd, left - s.damaged_odd) * 20 <= left;
    const bool checked = c.facts.serial.parity != Parity::none;
    if (c.window.uart && c.window.uart->parity + c.window.uart->framing >= 5) {
        const line::UartErrors& uart = *c.window.uart;
        return uart.parity > uart.framing ? Cause::wrong_parity : Cause::wrong_baud;
    }
    if (c.facts.serial.mode == SerialMode::ascii)  // damaged ASCII has no bytes to count
        return s.damaged_heads * 2 >= s.damaged() ? Cause::noise : Cause::wrong_baud;
    if (checked && same_pace && alike && s.damaged_zeros * 4 >= s.damaged_bytes)
        return Cause::wrong_parity;
    if (s.damaged_heads * 2 >= s.damaged()) return Cause::noise;
    return same_pace ? Cause::wrong_parity : Cause::wrong_baud;
}

void find_crc_order(Case& c, std::uint8_t station, const Symptoms& s) {
    const Bar bar{c, Cause::wrong_crc_order, named(station)};
    if (s.crc_swapped < bar.enough(3) || s.crc_swapped * 2 <= s.damaged()) return;
    if (s.crc_swapped <= s.answered) return;  // another order would damage these
    const bool set = c.facts.crc_high_first.contains(station);
    const std::string advice =
        set ? "Leave its `crc_order` out, or set it to `low_first`, the standard's; of the profile "
              "autonics-gp-2005-old the newer one is autonics-gp-2005."
            : std::string(station == 0 ? "List it, and set" : "Set") +
                  " its `crc_order: high_first`; Autonics GP panels with firmware of before June "
                  "2005 have the profile autonics-gp-2005-old, which sets it.";
    c.add(Cause::wrong_crc_order, named(station),
          "The replies of " + station_text(c, station) + " carry the CRC's " +
              (set ? "low" : "high") + " byte first.",
          advice,
          share_text(s.crc_swapped, s.damaged(), "damaged replies") +
              " are right but for the order of the CRC's bytes; " + std::to_string(s.answered) +
              " replies were right",
          {{"swapped", s.crc_swapped}, {"damaged", s.damaged()}, {"right", s.answered}});
}

void find_lower_case(Case& c, std::uint8_t station, const Symptoms& s) {
    const Bar bar{c, Cause::ascii_lower_case, named(station)};
    if (c.facts.serial.mode != SerialMode::ascii) return;
    if (s.lower_case < bar.enough(3) || s.lower_case * 2 <= s.damaged()) return;
    c.add(Cause::ascii_lower_case, named(station),
          "The replies of " + station_text(c, station) + " have lower-case hex digits.",
          "Set `serial: {ascii_lower_case: take}` of the line; the standard has upper case only.",
          share_text(s.lower_case, s.damaged(), "damaged replies") +
              " are written in lower case; " + std::to_string(s.answered) +
              " replies were right, as those without A to F are",
          {{"lower_case", s.lower_case}, {"damaged", s.damaged()}, {"right", s.answered}});
}

void find_delimiters(Case& c, std::uint8_t station, const Symptoms& s) {
    const Bar bar{c, Cause::ascii_delimiters, named(station)};
    if (c.facts.serial.mode != SerialMode::ascii) return;
    if (s.delimited < bar.enough(3) || s.delimited * 2 <= s.damaged()) return;
    c.add(Cause::ascii_delimiters, named(station),
          "The replies of " + station_text(c, station) +
              " do not begin with ':' and end with CR LF, as the standard has it.",
          "Set the panel to the standard's delimiters, or to RTU. An end that function 08 03 has "
          "changed is LF again behind the raw request 08 00 03 0A 00.",
          share_text(s.delimited, s.damaged(), "damaged replies") +
              " are right but for their first or last characters",
          {{"delimited", s.delimited}, {"damaged", s.damaged()}});
}

void find_all_damaged(Case& c) {
    const Symptoms s = unexplained(c);
    if (!is_all_damaged(c, s)) return;
    const Cause cause = cause_of_damage(c, s);
    const std::string evidence = damage_text(c, s);
    const std::string now = to_string(c.facts.serial);
    if (c.facts.over_tcp) {
        // Another length may also be caused by the connection.
        if (cause != Cause::wrong_parity || s.damaged_exact != s.damaged()) return;
        c.add(cause, {}, "Replies have the right length and wrong bytes: parity or data bits.",
              "Set the parity, data and stop bits of the server's serial port as in the panels' "
              "communication settings.",
              evidence, damage_figures(s));
    } else if (cause == Cause::wrong_parity) {
        c.add(cause, {}, "Replies have the right length and wrong bytes: parity or data bits.",
              "Set `serial.parity`, data and stop bits as in the panels' communication settings "
              "(now " +
                  now + ").",
              evidence, damage_figures(s));
    } else if (cause == Cause::wrong_baud && c.facts.serial.mode == SerialMode::ascii) {
        c.add(cause, {},
              "The bytes received are not Modbus ASCII: baud, data bits or parity differ.",
              "Set `serial` as in the panels' communication settings (now " + now +
                  "); panels that are set to RTU need `mode: rtu`.",
              evidence, damage_figures(s));
    } else if (cause == Cause::wrong_baud) {
        const bool breaks = c.window.uart && c.window.uart->breaks * 2 > c.window.uart->framing;
        c.add(cause, {}, "The bytes received are not Modbus at this speed: the baud differs.",
              std::string(breaks ? "A and B may be swapped. " : "") +
                  "Set `serial.baud` as in the panels' communication settings (now " + now + ").",
              evidence, damage_figures(s));
    }
}

namespace {

struct Noise {
    bool damage = false;       ///< replies are damaged
    bool strays = false;       ///< bytes come around or between frames
    std::uint64_t around = 0;  ///< so many times
};

std::string noise_advice(const Case& c, const Symptoms& s, const Noise& noise) {
    std::string advice =
        "Check the 120 ohm termination at both ends (and nowhere else), the bias, the shield and "
        "what runs beside the cable.";
    if (c.facts.over_tcp) advice = "On the line behind the server: " + advice;
    if (noise.damage && hits_long_replies(s))
        advice = "Long replies suffer most: look at the termination first. " + advice;
    if (noise.strays)
        advice = "Bytes arrive while no device is transmitting: look at the bias first. " + advice;
    if (noise.damage && loses_beginnings(s)) advice = std::string(kLostBeginnings) + " " + advice;
    return advice;
}

std::string noise_evidence(const Case& c, const Symptoms& s, const Noise& noise) {
    const std::string around =
        std::to_string(noise.around) + " times bytes around or between frames";
    if (!noise.damage) return around;
    std::string evidence = damage_text(c, s);
    if (hits_long_replies(s))
        evidence += "; " + share_text(s.long_damaged, s.long_damaged + s.long_answered,
                                      "replies of 32 bytes and more damaged");
    return noise.strays ? evidence + "; " + around : evidence;
}

}  // namespace

void find_noise(Case& c) {
    const Bar bar{c, Cause::noise};
    const Symptoms s = unexplained(c);
    const bool overrun =
        c.window.uart && c.has(Cause::overrun) && c.window.uart->overruns * 2 >= s.damaged();
    const std::uint64_t late = unheard_late_replies(c);
    // Over TCP replies are cut where the connection stalls, and the rest arrives alone.
    const std::uint64_t damaged = beyond(c.facts.over_tcp ? s.damaged_exact : s.damaged(), late);
    Noise noise;
    noise.damage = is_too_often(c, bar, s, damaged);
    noise.around = beyond(s.strays, late + surplus_frames(c));
    noise.strays = !c.facts.over_tcp && noise.around >= bar.enough(5) &&
                   noise.around * 20 >= s.answered && !are_of_one_station(c, s);
    if (overrun || (!noise.damage && !noise.strays)) return;
    Figures figures = noise.damage ? damage_figures(s) : Figures{};
    if (noise.strays) figures["strays"] = noise.around;
    c.add(
        Cause::noise, {},
        noise.damage ? "Some received frames are damaged." : "Bytes come that belong to no frame.",
        noise_advice(c, s, noise), noise_evidence(c, s, noise), std::move(figures));
}

/// The connection changes lengths: telnet doubles or removes bytes, and a server loses the first
/// ones. A wrong byte in a reply of the right length comes from the wire behind the server, and a
/// reply without its end from a connection that stalls, unless all are truncated.
void find_tcp_framing(Case& c) {
    if (!c.facts.over_tcp) return;
    const Bar bar{c, Cause::tcp_framing};
    const Symptoms s = unexplained(c);
    const bool never_right = is_all_damaged(c, s) && s.damaged_exact * 2 < s.damaged() &&
                             s.silent + s.disturbed <= s.damaged();
    const std::uint64_t changed =
        beyond(never_right ? s.damaged() : s.damaged_long + s.beheaded, unheard_late_replies(c));
    if (!is_too_often(c, bar, s, changed)) return;
    const std::string lost = loses_beginnings(s) ? std::string(kLostBeginnings) + " " : "";
    c.add(Cause::tcp_framing, {}, "Bytes are changed on the way from the server.",
          lost +
              "Make sure that its port is raw TCP without telnet negotiation (ser2net: no "
              "`telnet(rfc2217)`), that no other client is connected to it, and that its own baud "
              "and serial format are the panels'; then look at the line behind it.",
          damage_text(c, s), damage_figures(s));
}

}  // namespace panelgate::doctor
