// The shells around the arbiter in virtual time: each request is answered once, in order, in time,
// and with what the panel really held.
//
// PANELGATE_SCENARIO_SEED    this seed alone, with its history
// PANELGATE_HOUSE_SEEDS      of each kind (default 100; a tenth with sanitizers)

#include "house.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <string>
#include <utility>

#include "panelgate/rt/log.hpp"

namespace panelgate::scenario {
namespace {

std::uint64_t number_from(const char* variable, std::uint64_t fallback) {
    const char* text = std::getenv(variable);
    return text == nullptr ? fallback : std::strtoull(text, nullptr, 10);
}

std::uint64_t wanted_seeds() {
    const std::uint64_t all = number_from("PANELGATE_HOUSE_SEEDS", 100);
    const bool slow = number_from("PANELGATE_SANITIZED", 0) != 0;
    return slow ? std::max<std::uint64_t>(all / 10, 1) : all;
}

class HouseTest : public testing::TestWithParam<HouseKind> {
  protected:
    HouseTest() {
        rt::LogSettings quiet;
        quiet.level = rt::LogLevel::error;
        rt::set_up_log(quiet);
    }
};

TEST_P(HouseTest, KeepsItsPromises) {
    const std::uint64_t only = number_from("PANELGATE_SCENARIO_SEED", 0);
    const std::uint64_t first = only == 0 ? 1 : only;
    const std::uint64_t last = only == 0 ? wanted_seeds() : only;
    std::uint64_t answers = 0;
    std::uint64_t good = 0;
    std::uint64_t polls = 0;
    std::uint64_t relayed = 0;
    std::uint64_t to_masters = 0;
    for (std::uint64_t seed = first; seed <= last; ++seed) {
        House house(draw_house(GetParam(), seed), HouseSeam::Flaw::none);
        if (only != 0) house.keep_history();
        house.run();
        ASSERT_EQ(house.violation(), "")
            << "\n  replay: PANELGATE_SCENARIO_SEED=" << seed
            << " scenario_house --gtest_filter='*Promises/" << label(GetParam()) << "'\n"
            << house.history();
        answers += house.answers();
        good += house.good();
        polls += house.polls();
        relayed += house.relayed();
        to_masters += house.to_master();
    }
    std::cout << "  " << label(GetParam()) << ": " << answers << " answers of the bus, " << polls
              << " to polls, " << relayed << " writes of relays, " << to_masters
              << " to serial masters, " << good << " judged good\n";
    EXPECT_GT(good, 0u);
    EXPECT_GT(polls, 0u);
    EXPECT_EQ(relayed == 0, GetParam() == HouseKind::calm);
    if (only == 0) EXPECT_EQ(to_masters == 0, GetParam() == HouseKind::calm);
}

INSTANTIATE_TEST_SUITE_P(Every, HouseTest, testing::ValuesIn(kHouseKinds),
                         [](const auto& info) { return std::string(label(info.param)); });

/// Two speakers' bytes made a frame that passed its CRC.
TEST_F(HouseTest, KnowsWhatNobodyHasSaid) {
    House house(draw_house(HouseKind::loss, 437), HouseSeam::Flaw::none);
    house.run();
    EXPECT_EQ(house.violation(), "");
}

/// Seeds beyond those that each run plays: echoes that met a collision were taken for absent, and
/// bytes that were looked at late for the first behind a silence.
TEST_F(HouseTest, SeedsThatOnceBrokeAPromiseKeepThemAll) {
    constexpr std::pair<HouseKind, std::uint64_t> kKnown[] = {{HouseKind::sound, 265},
                                                              {HouseKind::memory, 358},
                                                              {HouseKind::loss, 358},
                                                              {HouseKind::master, 187}};
    for (const auto& [kind, seed] : kKnown) {
        House house(draw_house(kind, seed), HouseSeam::Flaw::none);
        house.run();
        EXPECT_EQ(house.violation(), "") << label(kind) << ' ' << seed;
    }
}

/// What a house that is broken on purpose is caught with, within some seeds.
struct Broken {
    HouseSeam::Flaw flaw;
    HouseKind kind;
    const char* name;
    const char* violation;
};

class BrokenHouse : public testing::TestWithParam<Broken> {
  protected:
    BrokenHouse() {
        rt::LogSettings quiet;
        quiet.level = rt::LogLevel::error;
        rt::set_up_log(quiet);
    }
};

TEST_P(BrokenHouse, IsCaught) {
    std::string found;
    for (std::uint64_t seed = 1; seed <= 20 && !found.starts_with(GetParam().violation); ++seed) {
        House house(draw_house(GetParam().kind, seed), GetParam().flaw);
        house.run();
        // Where the last request of a master meets the flaw, its port is found busy at the end.
        if (!house.violation().empty()) found = house.violation();
    }
    EXPECT_TRUE(found.starts_with(GetParam().violation)) << found;
}

using Flaw = HouseSeam::Flaw;
constexpr Broken kBroken[] = {
    {Flaw::deaf, HouseKind::calm, "ClockBeforeInput", "P4: a sound panel's request failed"},
    {Flaw::answers_twice, HouseKind::sound, "AnswersTwice", "a request was answered twice"},
    {Flaw::answers_never, HouseKind::sound, "AnswersNever", "a request was never answered"},
    {Flaw::answers_at_once, HouseKind::sound, "AnswersAtOnce", "answered from inside transact()"},
    {Flaw::answers_the_other, HouseKind::sound, "AnswersTheOther", "P1: "},
    {Flaw::remembers, HouseKind::memory, "Remembers", "P1: a value that the station did not have"},
    {Flaw::untold, HouseKind::sound, "UntoldPoller", "P6: a value older than a write"},
    {Flaw::polls_first, HouseKind::calm, "PollsFirst", "P9: polls went before"},
    {Flaw::keeps_withdrawn, HouseKind::master, "KeepsWhatAMasterGaveUp",
     "two requests of a serial master are open at once"},
    {Flaw::answers_the_next, HouseKind::master, "AnswersAMastersNext", "P1: "},
    {Flaw::spreads_twice, HouseKind::master, "SpreadsAMastersBroadcastTwice",
     "P2: a broadcast went out more often"},
    {Flaw::writes_twice, HouseKind::master, "WritesAMastersTwice",
     "P2: a write was executed more often"},
    {Flaw::silent_to_masters, HouseKind::master, "SilentToAMaster",
     "P3: a serial master was never answered"},
    {Flaw::serves_others, HouseKind::master, "AnswersForAMastersOtherSlave",
     "P1: a serial master is told what it did not ask for"},
};
INSTANTIATE_TEST_SUITE_P(Every, BrokenHouse, testing::ValuesIn(kBroken),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace panelgate::scenario
