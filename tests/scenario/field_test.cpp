// What was met in the field, or on a bench, each by itself: lines that an earlier arbiter served
// wrongly. Every plan is written out, so that it stays what it is whatever else is drawn.

#include <gtest/gtest.h>

#include "field.hpp"
#include "plan.hpp"
#include "play.hpp"

namespace panelgate::scenario {
namespace {

/// Behind a device server that hangs so often a second, and takes connections all the while.
Plan hanging_line(unsigned panels, double stalls) {
    Plan plan = quiet_line(19200, panels);
    plan.settings.may_stall = true;
    plan.line.stalls = stalls;
    plan.line.hangs = true;
    return plan;
}

TEST(Field, P1TheFirstBytesOfOurOwnRequestDoNotEndTheWaitForItsReply) {
    Plan plan = quiet_line(19200, 1, 30ms);
    plan.line.partial_echo = 1;
    add_client(plan, {1});
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P1AHeaderThatComesLongBeforeTheReplyOwesThatReply) {
    Plan plan = quiet_line(19200, 1, 10ms);
    plan.panels[0].fragment = 1;
    add_client(plan, {1});
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P1ADamagedReplyThatIsFollowedByTheGoodOneIsStillOwed) {
    Plan plan = quiet_line(38400, 2);
    plan.panels[0].damaged_first = 0.5;
    add_client(plan, {1}, 0.1);
    add_client(plan, {1, 2}, 0.1);
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P1WhatIsUnderWayWhenTheLineGoesAndComesBackAtOnceIsStillOwed) {
    Plan plan = quiet_line(19200, 1, 100ms);
    plan.line.losses = 1;
    plan.line.handover = 1;
    add_client(plan, {1});
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P1ALineThatHoldsEverythingBackNeverGivesAnOldReply) {
    Plan plan = quiet_line(19200, 2);
    plan.settings.may_stall = true;
    plan.line.stalls = 0.5;
    plan.settings.offline.after = 100;  // collisions behind a stall hide who has answered
    add_client(plan, {1}, 0.1).in_flight = 4;
    add_client(plan, {1, 2});
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P1ADeviceServerThatHangsAndTakesConnectionsAllTheWhileNeverGivesAnOldReply) {
    Plan plan = hanging_line(2, 0.5);
    plan.settings.offline.after = 100;  // collisions behind a stall hide who has answered
    add_client(plan, {1}, 0.1).in_flight = 4;
    add_client(plan, {1, 2});
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P1BehindAHangAPanelThatAnswersOneLengthAloneNeverGivesAnOldReply) {
    Plan plan = hanging_line(1, 0.2);
    plan.panels[0].only_registers = 4;
    add_client(plan, {1}).in_flight = 4;
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P4APanelThatIsSilentToWhatNobodyAskedComesBackWhenADeviceServerGoesOn) {
    Plan plan = hanging_line(1, 0.05);
    plan.seed = 1;
    plan.transactions = 5000;
    add_client(plan, {1}).same_read = true;
    const Outcome plain = play(plan);
    plan.panels[0].only_registers = 10;  // what the client asks for
    const Outcome choosy = play(plan);
    EXPECT_EQ(choosy.violation, "");
    const auto rate = [](const Outcome& of) { return static_cast<double>(of.good) / of.seconds; };
    EXPECT_GT(rate(choosy), 0.8 * rate(plain));
}

TEST(Field, P1AQuickPanelBesideSlowOnesIsNotTooEarly) {
    Plan plan = quiet_line(115200, 3);
    plan.panels[1].think = 300us;
    plan.panels[1].eager = true;
    plan.settings.echo = EchoMode::automatic;
    add_client(plan, {1, 2, 3}, 0.3);
    EXPECT_EQ(broken(plan), "");
    plan.settings.paced = true;
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P1AUartThatIsSlightlyFastLosesNoConfirmation) {
    Plan plan = quiet_line(9600, 2);
    plan.settings.paced = true;
    plan.line.own_rate = 0.985;
    plan.panels[0].think = 300us;
    plan.panels[0].eager = true;
    add_client(plan, {1, 2}, 0.5);
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P6ReadsThatWereJoinedOnFaithAreSplitHoweverThePanelRefuses) {
    for (const unsigned refusal : {0u, 1u, 2u, 3u, 4u}) {
        Plan plan = quiet_line(38400, 2);
        plan.panels[0].max_registers = 20;
        plan.panels[0].refusal = refusal;
        for (int i = 0; i < 4; ++i) add_client(plan, {1, 2}).in_flight = 2;
        EXPECT_EQ(broken(plan), "") << "refused with " << refusal;
    }
}

TEST(Field, P8OneByteBehindEachReplyLeavesWritesConfirmed) {
    Plan plan = quiet_line(19200, 2);
    plan.settings.echo = EchoMode::automatic;
    plan.panels[0].glitch_behind = 1;
    add_client(plan, {1, 2}, 0.5);
    EXPECT_EQ(broken(plan), "");
    plan.clients[0].writes = 1;
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P8AnAnswerToABroadcastThatOutlastsTheTurnaroundConfirmsNoWrite) {
    Plan plan = quiet_line(19200, 2, 120ms);
    plan.settings.broadcast_turnaround = 20ms;
    plan.panels[0].answers_broadcasts = true;
    plan.panels[0].broadcast_think = 100ms;
    plan.panels[0].drop = 0.5;
    plan.transactions = 3000;
    add_client(plan, {1}, 1).broadcasts = 0.3;
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P7APauseInsideAReplyIsPartOfIt) {
    for (const int baud : {2400, 9600, 115200}) {
        Plan plan = quiet_line(baud, 2);
        plan.settings.share_reads = false;
        plan.panels[0].hole = 0.5;
        plan.panels[0].hole_limit = 40ms;
        add_client(plan, {1, 2}, 0.2);
        EXPECT_EQ(broken(plan), "") << baud;
    }
}

TEST(Field, P8AnEchoThatLacksItsLastByteOrHasABitErrorCostsNothingButItself) {
    Plan plan = quiet_line(38400, 2);
    plan.settings.echo = EchoMode::automatic;
    plan.line.echo = true;
    plan.line.cut_echo = 1;
    add_client(plan, {1, 2}, 0.3);
    EXPECT_EQ(broken(plan), "");
    plan.line.cut_echo = 0;
    plan.line.damaged_echo = 0.05;
    EXPECT_EQ(broken(plan), "");
}

TEST(Field, P8TheFirstByteOfAnEchoDoesNotMakeQuickWritesOld) {
    Plan plan = quiet_line(38400, 2, 300us);
    plan.settings.echo = EchoMode::automatic;
    for (PanelPlan& panel : plan.panels) panel.eager = true;
    add_client(plan, {1, 2}, 0.3);
    EXPECT_EQ(broken(plan), "");
}

}  // namespace
}  // namespace panelgate::scenario
