// What concerns everybody on the line.

#include "rules.hpp"

namespace panelgate::doctor {

using arbiter::Symptoms;

namespace {

/// Nearly everything that comes is damaged: one in ten may be good by chance.
bool is_all_damaged(const Case& c, const Symptoms& s) {
    const Bar bar{c, cause_of_damage(c, s)};
    return s.damaged() >= bar.enough(5) && s.answered * 10 <= s.damaged();
}

}  // namespace

/// The length tells the pace, and zeros tell bytes that the parity check has thrown away.
Cause cause_of_damage(const Case& c, const Symptoms& s) {
    const bool same_pace = s.damaged_exact * 5 >= s.damaged() * 4;
    // Bytes that pass a wrong parity check all have the same parity; what noise leaves has both.
    const std::uint64_t left = s.damaged_bytes - s.damaged_zeros;
    const bool alike = std::min(s.damaged_odd, left - s.damaged_odd) * 20 <= left;
    const bool checked = c.facts.serial.parity != Parity::none;
    if (c.window.uart && c.window.uart->parity + c.window.uart->framing >= 5) {
        const line::UartErrors& uart = *c.window.uart;
        return uart.parity > uart.framing ? Cause::wrong_parity : Cause::wrong_baud;
    }
    if (checked && same_pace && alike && s.damaged_zeros * 4 >= s.damaged_bytes)
        return Cause::wrong_parity;
    if (s.damaged_heads * 2 >= s.damaged()) return Cause::noise;
    return same_pace ? Cause::wrong_parity : Cause::wrong_baud;
}

void find_echo(Case& c) {
    const Bar bar{c, Cause::echo};
    if (c.facts.echo == LineFacts::Echo::off && c.all.echoes >= bar.enough(3)) {
        c.add(
            Cause::echo, {}, "The adapter hears what it sends, and `echo: off` denies it.",
            "Set `echo: auto` or `echo: on`, or switch the adapter's receiver off while it sends.",
            std::to_string(c.all.echoes) + " requests came back as they were sent");
    }
    if (c.facts.echo == LineFacts::Echo::on && c.all.echoes == 0 &&
        c.all.collided + c.all.silent >= bar.enough(5) && c.all.collided >= bar.enough(3)) {
        c.add(Cause::echo, {}, "No request comes back, although `echo: on` says so.",
              "Set `echo: auto` or `echo: off`.",
              "instead of its echo something else followed " +
                  share_text(c.all.collided, c.all.attempts(), "requests"));
    }
}

/// All panels at once: the line, not a panel.
void find_no_answer(Case& c) {
    const Bar bar{c, Cause::no_answer_at_all};
    std::uint64_t mute = 0;
    int stations = 0;
    for (const auto& [id, symptoms] : c.window.stations) {
        if (symptoms.attempts() == 0) continue;
        if (symptoms.mute_in_a_row < bar.enough(3)) return;
        // Who asks for addresses that nobody has, finds nobody: a scan.
        if (id == 0 && c.window.stations.size() > 1) continue;
        mute += symptoms.mute_in_a_row;
        ++stations;
    }
    if (mute < bar.enough(6)) return;
    std::string advice =
        "Check the power of the panels, the wires A and B (swapped?) and their bias, `serial` "
        "(now " +
        to_string(c.facts.serial) + ") and the stations' addresses.";
    std::string evidence = std::to_string(stations) + " station(s) asked, the last " +
                           std::to_string(mute) + " requests without a reply";
    if (c.window.uart && c.window.uart->breaks >= bar.enough(3)) {
        advice =
            "Swap the wires A and B, or give the line a bias: the receiver sees breaks. " + advice;
        evidence += "; the driver counted " + std::to_string(c.window.uart->breaks) + " breaks";
    }
    c.add(Cause::no_answer_at_all, {}, "Nobody answers on this line.", std::move(advice),
          std::move(evidence));
}

void find_all_damaged(Case& c) {
    if (!is_all_damaged(c, c.all) || c.has(Cause::echo)) return;
    const Cause cause = cause_of_damage(c, c.all);
    const std::string evidence = damage_text(c, c.all);
    const std::string now = to_string(c.facts.serial);
    if (cause == Cause::wrong_parity) {
        c.add(cause, {}, "Replies have the right length and wrong bytes: parity or data bits.",
              "Set `serial.parity`, data and stop bits as in the panels' communication settings "
              "(now " +
                  now + ").",
              evidence);
    } else if (cause == Cause::wrong_baud) {
        const bool breaks = c.window.uart && c.window.uart->breaks * 2 > c.window.uart->framing;
        c.add(cause, {}, "What comes is no Modbus at this speed: the baud differs.",
              std::string(breaks ? "A and B may be swapped. " : "") +
                  "Set `serial.baud` as in the panels' communication settings (now " + now + ").",
              evidence);
    }
}

void find_other_master(Case& c) {
    const Bar bar{c, Cause::other_master};
    if (c.all.unasked < bar.enough(3) || c.all.unasked < c.all.doubled) return;
    c.add(Cause::other_master, {}, "Frames that this gateway did not ask for are on the line.",
          "Take the other master (a PLC, a PC, a second gateway) off the line; if there is none, a "
          "panel answers with an address that is not its own.",
          std::to_string(c.all.unasked) + " good frames that belong to no request, and " +
              std::to_string(c.all.attempts()) + " requests");
}

void find_collision(Case& c) {
    const Bar bar{c, Cause::collision};
    if (c.all.collided < bar.enough(3) || c.has(Cause::echo)) return;
    c.add(Cause::collision, {}, "Somebody speaks while the gateway does.",
          "Look for another master, for a panel that answers very late, and for a transceiver that "
          "does not release the line.",
          share_text(c.all.collided, c.all.attempts(), "requests") + " came back changed");
}

void find_overrun(Case& c) {
    const Bar bar{c, Cause::overrun};
    if (!c.window.uart || c.window.uart->overruns < bar.enough(2)) return;
    c.add(Cause::overrun, {}, "The serial driver lost bytes.",
          "Give the gateway more of the processor, lower `serial.baud`, or use an adapter with a "
          "larger buffer.",
          std::to_string(c.window.uart->overruns) + " overruns; " + damage_text(c, c.all));
}

namespace {

/// What one address or another cause explains is no noise.
Symptoms unexplained(const Case& c) {
    Sample rest;
    for (const auto& [id, symptoms] : c.window.stations) {
        const bool explained =
            c.has(Cause::duplicate_address, id) || c.has(Cause::wrong_parity, id);
        if (!explained) rest.stations[id] = symptoms;
    }
    return rest.total();
}

/// All of few damaged replies came from one of several stations: it may be that one, or chance.
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

double share(std::uint64_t part, std::uint64_t whole) {
    return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

/// A long reply is hit more often than by its length alone: what reflections do.
bool hits_long_replies(const Symptoms& s) {
    const std::uint64_t short_damaged = s.damaged() - s.long_damaged;
    const std::uint64_t short_answered = s.answered - s.long_answered;
    constexpr std::uint64_t kEnough = 10;
    return s.long_damaged >= 3 && short_answered >= kEnough &&
           share(s.long_damaged, s.long_damaged + s.long_answered) >
               3 * share(short_damaged, short_damaged + short_answered);
}

}  // namespace

void find_noise(Case& c) {
    for (const Cause better :
         {Cause::echo, Cause::wrong_baud, Cause::other_master, Cause::collision}) {
        if (c.has(better)) return;
    }
    const Bar bar{c, Cause::noise};
    const Symptoms s = unexplained(c);
    const bool all_wrong = is_all_damaged(c, c.all) && c.has(Cause::wrong_parity);
    const bool overrun =
        c.window.uart && c.has(Cause::overrun) && c.window.uart->overruns * 2 >= s.damaged();
    // One damaged frame in a thousand is life; one in a hundred is a fault.
    const double limit = bar.low ? 0.003 : 0.01;
    const bool damage = s.damaged() >= bar.enough(3) && (bar.low || !may_be_one_station(c, s)) &&
                        share(s.damaged(), s.damaged() + s.answered) >= limit;
    const bool strays = s.strays >= bar.enough(5) && s.strays * 20 >= s.answered;
    if (all_wrong || overrun || (!damage && !strays)) return;
    std::string advice =
        "Check the 120 ohm termination at both ends (and nowhere else), the bias, the shield and "
        "what runs beside the cable.";
    std::string evidence = damage_text(c, s);
    if (hits_long_replies(s)) {
        advice = "Long replies suffer most: look at the termination first. " + advice;
        evidence += "; " + share_text(s.long_damaged, s.long_damaged + s.long_answered,
                                      "replies of 32 bytes and more damaged");
    }
    if (strays) {
        advice = "Bytes come when nobody speaks: look at the bias first. " + advice;
        evidence += "; " + std::to_string(s.strays) + " times bytes around or between replies";
    }
    c.add(Cause::noise, {}, "Some of what comes is damaged.", std::move(advice),
          std::move(evidence));
}

}  // namespace panelgate::doctor
