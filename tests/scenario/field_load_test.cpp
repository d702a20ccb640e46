// More of what field_test.cpp does: what the odd, the dead and the many cost the others.

#include <gtest/gtest.h>

#include <vector>

#include "field.hpp"
#include "plan.hpp"
#include "play.hpp"

namespace panelgate::scenario {
namespace {

TEST(Field, P4TenDeadStationsThatAreWrittenCyclicallyCostLittle) {
    Plan plan = quiet_line(115200, 18);
    std::vector<std::uint8_t> healthy;
    std::vector<std::uint8_t> dead;
    for (std::size_t i = 0; i < 18; ++i) {
        plan.panels[i].dead = i >= 8;
        (i < 8 ? healthy : dead).push_back(plan.panels[i].id);
    }
    for (int i = 0; i < 4; ++i) add_client(plan, healthy);
    add_client(plan, dead, 1);
    plan.transactions = 5000;
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P9AReaderBesideEndlessWritesGetsEveryFifthTurn) {
    Plan plan = quiet_line(115200, 3);
    add_client(plan, {1, 2}, 1).in_flight = 16;
    add_client(plan, {1, 2}, 1).in_flight = 16;
    add_client(plan, {3});
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P9APoliteClientBesideFortyConnectionsOfOneHostIsAlwaysAnswered) {
    Plan plan = quiet_line(38400, 4);
    plan.settings.queue.deadline = 4s;
    for (int i = 0; i < 40; ++i) {
        ClientPlan& flood = add_client(plan, {1, 2, 3, 4}, 0.2);
        flood.in_flight = 16;
        flood.host = 1;
    }
    ClientPlan& polite = add_client(plan, {1, 2, 3, 4}, 0.3);
    polite.host = 2;
    polite.polite = true;
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P5ALostFrameLeavesTheLineToRequestsForOtherStations) {
    Plan plan = quiet_line(38400, 2);
    plan.panels[0].mute = 0.1;
    add_client(plan, {1, 2}).in_flight = 8;
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P5ALineThatFloatsIsUsedAllTheSame) {
    Plan plan = quiet_line(19200, 2);
    plan.settings.queue.deadline = 900ms;
    plan.line.floating = 0.2;
    add_client(plan, {1, 2});
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P4AClientThatScansAllIdsDoesNotKeepADeadPanelFromComingBack) {
    Plan plan = quiet_line(38400, 4);
    plan.panels[3].dead = true;
    add_client(plan, {1, 2, 3}).in_flight = 4;
    add_client(plan, {4});
    ClientPlan& scan = add_client(plan, {});
    scan.scans = true;
    scan.pause = 1ms;
    plan.transactions = 20000;
    plan.seed = 1;
    const Outcome outcome = play(plan, true);
    EXPECT_EQ(outcome.violation, "") << outcome.history;
    EXPECT_GT(outcome.seconds, 60);
    EXPECT_LT(to_seconds(outcome.longest_unasked.at(4)), 30);
}

TEST(Field, P2WhatAClientThatLeftHadAskedIsNotAskedAgain) {
    Plan plan = quiet_line(38400, 2);
    plan.settings.unlisted.retries = 2;
    for (arbiter::StationSettings& station : plan.settings.stations) {
        station.retry_writes = true;
        station.retries = 2;
    }
    for (PanelPlan& panel : plan.panels) panel.drop = 0.3;
    for (int i = 0; i < 3; ++i) {
        ClientPlan& client = add_client(plan, {1, 2}, 0.5);
        client.leaves = 2;
        client.in_flight = 4;
    }
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P3AfterAPauseOfTheProcessNothingIsAnsweredThatIsPastItsDeadline) {
    Plan plan = quiet_line(38400, 2, 50ms);
    plan.line.pauses = 0.3;
    add_client(plan, {1, 2}, 0.2).in_flight = 4;
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P4TheMomentOfDyingCostsTheOthersOneTimeoutOnce) {
    Plan plan = quiet_line(38400, 5);
    plan.panels[4].flapping = 10s;
    add_client(plan, {1, 2, 3, 4, 5}, 0.1).in_flight = 5;
    for (std::uint8_t id = 1; id <= 5; ++id) add_client(plan, {id}, 0.1);
    plan.transactions = 3000;
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P4AWriteToADeadPanelCostsNoMoreThanAProbe) {
    Plan plan = quiet_line(38400, 3);
    plan.panels[2].flapping = 20s;
    add_client(plan, {1, 2}).in_flight = 4;
    add_client(plan, {3}, 1);
    plan.transactions = 5000;
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P4AnAdaptiveTimeoutIsNoReasonToLoseAPanelThatBecameSlow) {
    Plan plan = quiet_line(38400, 2, 500us);
    for (arbiter::StationSettings& station : plan.settings.stations)
        station.adaptive_timeout = true;
    plan.panels[0].slow_think = 80ms;
    plan.panels[0].swing = 2s;
    add_client(plan, {1, 2}, 0.2);
    add_client(plan, {1, 2});
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P4AnIdThatNobodyListedAndNobodyHeardCostsOneShortAttempt) {
    Plan plan = quiet_line(38400, 3);
    add_client(plan, {1, 2, 3}).in_flight = 4;
    ClientPlan& scan = add_client(plan, {});
    scan.scans = true;
    plan.transactions = 2000;
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P6AThousandEqualReadsCostOneTransactionAndNoRefusal) {
    Plan plan = quiet_line(38400, 1);
    for (int i = 0; i < 1024; ++i) {
        ClientPlan& client = add_client(plan, {1});
        client.same_read = true;
        client.host = static_cast<std::uint64_t>(i % 7) + 1;
    }
    plan.transactions = 20;
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P4TenOfTwentyThatDieAtOnceLeaveTheLineToTheOthers) {
    Plan plan = quiet_line(38400, 20);
    std::vector<std::uint8_t> all;
    for (PanelPlan& panel : plan.panels) {
        all.push_back(panel.id);
        if (panel.id % 2 == 0) panel.flapping = 20s;
    }
    for (const std::uint8_t id : all) add_client(plan, {id});
    add_client(plan, all, 0.1).in_flight = 8;
    plan.transactions = 5000;
    EXPECT_EQ(broken(plan), "");
}

/// The longest silence behind a lost frame, thousands of good replies after one that was late.
TEST(Field, P4OneVeryLateReplyIsForgottenInTheEnd) {
    Plan plan = quiet_line(115200, 2, 1ms);
    plan.panels[0].nap = 0.0002;
    plan.panels[0].drop = 0.002;
    add_client(plan, {1, 2}).in_flight = 4;
    plan.transactions = 30000;
    plan.seed = 1;
    const Outcome outcome = play(plan);
    EXPECT_LT(to_seconds(outcome.longest_idle), 3);
}

/// It asks in the silence before our panel's reply, and answers when we have begun: unavoidable.
/// Behind its question its reply is let pass.
TEST(Field, P5AnotherPoliteMasterCostsNoMoreThanItsOwnFrames) {
    Plan plan = quiet_line(38400, 3);
    add_client(plan, {1}).pause = 60ms;
    add_client(plan, {2, 3}).pause = 60ms;
    plan.transactions = 2000;
    plan.seed = 1;
    const Outcome alone = play(plan);
    plan.line.other_master = true;
    const Outcome beside = play(plan);
    EXPECT_EQ(alone.violation + beside.violation, "");
    EXPECT_LT(p90(beside.waits), 3 * p90(alone.waits));
    EXPECT_LT(beside.collisions, beside.frames / 10);
}

}  // namespace
}  // namespace panelgate::scenario
