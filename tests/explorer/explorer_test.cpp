// Everything that can happen in a few small worlds, to a depth that is told.
//
// PANELGATE_EXPLORER_STATES  distinct states in all (default 1 000 000; a tenth with sanitizers)

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <iostream>
#include <map>
#include <ostream>
#include <string>
#include <vector>

#include "explorer.hpp"
#include "support/bus_script.hpp"
#include "support/environment.hpp"
#include "worlds.hpp"

namespace panelgate::explorer {
namespace {

std::size_t wanted_states() { return test::amount_from("PANELGATE_EXPLORER_STATES", 1'000'000); }

class SmallWorld : public testing::TestWithParam<Rules> {};

TEST_P(SmallWorld, KeepsEveryPromiseWhateverHappens) {
    const Rules& rules = GetParam();
    Explorer explorer(rules, Flaw::none);
    const auto found = explorer.run(wanted_states() / small_worlds().size() + 1);
    std::cout << "  " << rules.name << ": " << explorer.states() << " states, " << explorer.moves()
              << " moves, all scripts of " << explorer.depth() << " moves\n";
    ASSERT_FALSE(found) << found->violation << "\n" << explorer.tell(found->moves);
}

INSTANTIATE_TEST_SUITE_P(Every, SmallWorld, testing::ValuesIn(small_worlds()),
                         [](const auto& info) { return info.param.name; });

/// An arbiter that is broken on purpose, or told something wrong.
struct Mutant {
    const char* name = "";
    const char* caught_as = "";
    const char* world = "";
    Flaw flaw = Flaw::none;
    std::function<void(arbiter::Settings&)> mislead = [](arbiter::Settings&) {};

    friend void PrintTo(const Mutant& mutant, std::ostream* out) { *out << mutant.name; }
};

Rules world_of(const std::string& name) {
    const std::vector<Rules> worlds = small_worlds();
    return *std::ranges::find(worlds, name, &Rules::name);
}

void each_station(arbiter::Settings& settings,
                  const std::function<void(arbiter::StationSettings&)>& change) {
    change(settings.unlisted);
    for (arbiter::StationSettings& station : settings.stations) change(station);
}

void no_late_window(arbiter::Settings& settings) {
    each_station(settings, [](auto& station) { station.late_window = 0ms; });
}

const Mutant kMutants[] = {
    {"ForgetsWhatIsOwedWhenTheLineIsLost", "P1", "Line", Flaw::forgets_at_line_loss},
    {"RepeatsAtAPartialEcho", "P1", "Noise", Flaw::repeats_at_partial_echo},
    {"AnswersTwice", "P3: answered twice", "Silence", Flaw::answers_twice},
    {"LosesAnAnswer", "P3", "Silence", Flaw::loses_an_answer},
    {"IgnoresWhoLeft", "P5: a read was sent for nobody", "Leaving", Flaw::ignores_who_left},
    {"Spins", "P9: its deadline", "Silence", Flaw::spins},
    {"HasNoLateWindow", "P1", "Silence", Flaw::none, no_late_window},
    {"RepeatsWrites", "P2: a write was sent twice", "Silence", Flaw::none,
     [](arbiter::Settings& s) {
         each_station(s, [](auto& station) { station.retry_writes = true; });
     }},
    {"SendsTwice", "P5: sent within the gap", "Silence", Flaw::sends_twice},
    {"TakesNoSlowReplyBehindASilence", "P5: a good reply in time was not taken", "Silence",
     Flaw::takes_no_slow_reply},
    {"TrustsALineThatStalls", "P1", "Stalls", Flaw::none,
     [](arbiter::Settings& s) { s.may_stall = false; }},
};

class Mutation : public testing::TestWithParam<Mutant> {};

TEST_P(Mutation, IsFound) {
    const Mutant& mutant = GetParam();
    const Rules rules = world_of(mutant.world);
    arbiter::Settings told = rules.settings;
    mutant.mislead(told);
    Explorer explorer(rules, told, mutant.flaw);
    const auto found = explorer.run(100'000);
    ASSERT_TRUE(found) << explorer.states() << " states";
    EXPECT_TRUE(found->violation.starts_with(mutant.caught_as)) << found->violation << "\n"
                                                                << explorer.tell(found->moves);
}

INSTANTIATE_TEST_SUITE_P(Every, Mutation, testing::ValuesIn(kMutants),
                         [](const auto& info) { return std::string(info.param.name); });

/// A script that was found is a test as it stands: here too, a read gets another one's value.
TEST(Explorer, WhatItTellsPlaysInABusScript) {
    const Rules rules = world_of("Silence");
    arbiter::Settings told = rules.settings;
    no_late_window(told);
    Explorer explorer(rules, told, Flaw::none);
    const auto found = explorer.run(100'000);
    ASSERT_TRUE(found);
    test::BusScript bus(told);
    std::map<arbiter::Ticket, unsigned> address;
    for (const test::BusStep& step : explorer.steps(found->moves)) {
        const auto ticket = bus.play(step);
        if (ticket) address[*ticket] = step.bytes[2];
    }
    EXPECT_TRUE(std::ranges::any_of(bus.answers, [&](const auto& answer) {
        const auto& [ticket, told_answer] = answer;
        return told_answer.pdu && (*told_answer.pdu)[2] != address.at(ticket);
    })) << explorer.tell(found->moves);
}

}  // namespace
}  // namespace panelgate::explorer
