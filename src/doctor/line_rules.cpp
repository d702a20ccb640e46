// What concerns everybody on the line.

#include <optional>
#include <string>
#include <vector>

#include "rules.hpp"

namespace panelgate::doctor {

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

namespace {

std::string silence_advice(const LineFacts& facts) {
    if (facts.over_tcp)
        return "The connection stands. Check whether the server reaches its serial port and "
               "nobody else holds that, its baud and parity, the power of the panels and the "
               "stations' addresses.";
    return "Check the power of the panels, the wires A and B (swapped?) and their bias, `serial` "
           "(now " +
           to_string(facts.serial) + ") and the stations' addresses.";
}

/// Good frames of stations that nobody here has asked. After a broadcast whoever speaks may be
/// answering it, which is wrong, but no master.
std::uint64_t strangers(const Case& c) {
    if (c.window.broadcasts > 0) return 0;
    std::uint64_t frames = 0;
    for (const auto& [id, symptoms] : c.window.stations) {
        if (symptoms.attempts() == 0) frames += symptoms.unasked;
    }
    return frames;
}

}  // namespace

/// All panels at once: the line, not a panel.
void find_no_answer(Case& c) {
    const Bar bar{c, Cause::no_answer_at_all};
    std::uint64_t mute = 0;
    std::uint64_t stations = 0;
    for (const auto& [id, symptoms] : c.window.stations) {
        if (symptoms.attempts() == 0) continue;
        // A scan of unlisted addresses finds nobody: that says nothing about the line.
        if (id == 0 && symptoms.answered == 0 && c.window.stations.size() > 1) continue;
        if (symptoms.mute_in_a_row < bar.enough(3)) return;
        if (symptoms.wrong * 2 >= symptoms.attempts()) return;  // not what was asked, yet a voice
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
    c.add(Cause::no_answer_at_all, {}, "Nobody answers on this line.", std::move(advice),
          std::move(evidence), {{"stations", stations}, {"requests", mute}});
}

void find_other_master(Case& c) {
    const Bar bar{c, Cause::other_master};
    const std::uint64_t frames = strangers(c);
    if (c.all.requests + frames < bar.enough(3)) return;
    const bool heard = c.all.requests > 0;
    c.add(Cause::other_master, {},
          heard ? "Somebody else asks on this line."
                : "Stations answer that this gateway did not ask.",
          heard ? "Take the other master (a PLC, a PC, a second gateway) off the line."
                : "Take the other master (a PLC, a PC, a second gateway) off the line; if there is "
                  "none, a panel speaks unasked or with an address that is not its own.",
          std::to_string(c.all.requests) + " requests of somebody else, " + std::to_string(frames) +
              " frames of stations that were not asked, and " + std::to_string(c.all.attempts()) +
              " requests of this gateway",
          {{"foreign_requests", c.all.requests},
           {"foreign_frames", frames},
           {"requests", c.all.attempts()}});
}

void find_collision(Case& c) {
    const Bar bar{c, Cause::collision};
    if (c.all.collided < bar.enough(3) || c.has(Cause::echo)) return;
    c.add(Cause::collision, {}, "Somebody speaks while the gateway does.",
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

/// Something follows most replies. A copy of the reply is another story: duplicate_address.
bool trails(const Case& c, std::uint8_t station, const Symptoms& s) {
    Bar bar{c, Cause::trailing_bytes, named(station)};
    bar.low = bar.low || c.stands(Cause::trailing_bytes);
    const std::uint64_t followed = s.trailed - std::min(s.trailed, s.doubled);
    return followed >= bar.enough(5) && followed * (bar.low ? 4 : 2) >= s.answered;
}

void add_trailing(Case& c, std::optional<std::uint8_t> station, const std::string& whose,
                  const Symptoms& s) {
    c.add(Cause::trailing_bytes, station, "Bytes follow the replies of " + whose + ".",
          "Look at when the transceiver stops sending and at the line's bias; if that cannot be "
          "changed, set `timing.frame_gap` so long that they have passed: 10ms, or more if this "
          "finding stays.",
          share_text(s.trailed, s.answered, "replies") + " had bytes behind them",
          {{"trailed", s.trailed}, {"replies", s.answered}});
}

}  // namespace

void find_trailing_bytes(Case& c) {
    if (c.has(Cause::other_master) || c.has(Cause::echo)) return;
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

}  // namespace panelgate::doctor
