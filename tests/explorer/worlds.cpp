#include "worlds.hpp"

#include <initializer_list>
#include <string>

namespace panelgate::explorer {
namespace {

using enum Verb;

std::uint32_t bits(std::initializer_list<Verb> verbs) {
    std::uint32_t all = 0;
    for (const Verb verb : verbs) all |= bit(verb);
    return all;
}

const std::uint32_t kTime = bits({submit, reply, rest, deadline, half});
const std::uint32_t kBadReplies = bits({lost, damaged, cut, hole, behind_header, behind_glitch});
const std::uint32_t kNoise = bits({partial_echo, header, glitch});
const std::uint32_t kLine = bits({line_blinks, line_lost});

const Wish kX{.client = 1, .station = 1, .address = 10};
const Wish kY{.client = 2, .station = 1, .address = 20};
const Wish kOther{.client = 1, .station = 2, .address = 30};
const Wish kWrite{.client = 2, .station = 1, .address = 40, .write = true};

Rules world(std::string name, std::uint32_t verbs, int faults) {
    Rules rules;
    rules.name = std::move(name);
    rules.settings = small_settings();
    rules.wishes = {kX, kY, kOther, kWrite};
    rules.verbs = kTime | verbs;
    rules.faults = faults;
    return rules;
}

}  // namespace

std::vector<Rules> small_worlds() {
    std::vector<Rules> worlds;
    worlds.push_back(world("Silence", 0, 0));
    worlds.push_back(world("Noise", kNoise, 2));
    worlds.push_back(world("Line", kLine, 2));
    worlds.push_back(world("Leaving", kLine | bits({leave, lost}), 2));
    worlds.push_back(world("BadReplies", kBadReplies, 2));
    worlds.push_back(world("All", kBadReplies | kNoise | kLine | bits({leave}), 3));

    Rules line = world("QuarantineOfTheLine", kNoise | kLine | bits({lost}), 2);
    line.settings.quarantine = arbiter::Quarantine::line;
    worlds.push_back(line);
    Rules station = world("QuarantineOfTheStation", kNoise | kLine | bits({lost}), 2);
    station.settings.quarantine = arbiter::Quarantine::station;
    worlds.push_back(station);
    Rules learning = world("EchoIsLearned", kNoise | kLine | bits({damaged}), 2);
    learning.settings.echo = EchoMode::automatic;
    worlds.push_back(learning);
    Rules joined = world("TouchingReads", kBadReplies | bits({line_blinks}), 2);
    joined.wishes = {kX, {.client = 2, .station = 1, .address = 11}, kWrite};
    joined.settings.stations[0].vouched = true;
    joined.open_per_client = 2;
    worlds.push_back(joined);
    Rules tcp = world("Stalls", bits({lost, line_lost, damaged}), 2);
    tcp.settings.may_stall = true;
    tcp.stalls = true;
    tcp.full_duplex = true;
    worlds.push_back(tcp);
    Rules hanging = tcp;
    hanging.name = "Hangs";
    hanging.hangs = true;
    hanging.verbs = world("", bits({lost, line_blinks}), 0).verbs;
    worlds.push_back(hanging);
    return worlds;
}

}  // namespace panelgate::explorer
