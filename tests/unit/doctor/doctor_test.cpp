// Samples of counters, and the doctor that compares them over a window.
#include "panelgate/doctor/doctor.hpp"

#include <gmock/gmock.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "case.hpp"

namespace panelgate::doctor::doctor_test {
namespace {

using arbiter::Symptoms;
using testing::ElementsAre;

TEST(Sample, ADifferenceCountsWhatCameBetweenAndKeepsWhatIsNow) {
    Sample before, after;
    before.stations[1] = Mix().answered(10, 0).silent(3).late(2, 50ms);
    after.stations[1] = Mix().answered(15, 0).silent(7).late(3, 60ms);
    after.stations[2] = Mix().damaged(4);
    after.uart = line::UartErrors{9, 8, 7, 6};
    before.broadcasts = 4;
    after.broadcasts = 6;
    const Sample window = difference(after, before);
    const Symptoms& one = window.stations.at(1);
    EXPECT_THAT((std::vector{one.answered, one.answered_after[0], one.silent, one.late}),
                ElementsAre(5u, 5u, 4u, 1u));
    EXPECT_EQ(one.mute_in_a_row, 7u);
    EXPECT_EQ(one.worst_lateness, Duration(60ms));
    EXPECT_EQ(window.stations.at(2).damaged(), 4u);
    EXPECT_EQ(window.attempts(), 13u);
    EXPECT_EQ(window.broadcasts, 2u);
    EXPECT_EQ(window.uart, (line::UartErrors{9, 8, 7, 6}));
    EXPECT_EQ(difference(after, after).attempts(), 0u);
    EXPECT_EQ(difference(after, after).uart, (line::UartErrors{}));
    EXPECT_EQ(window.total().worst_lateness, Duration(60ms));
}

TEST(Sample, ATotalAddsWhatIsCountedAndTakesTheWorstOfTheRest) {
    Sample sample;
    sample.stations[1] = Mix().answered(10, 0).late(2, 50ms);
    sample.stations[2] = Mix().lost(3, 1).late(1, 80ms);
    sample.stations[0] = Mix().lost(9, 1).with(&Symptoms::mute_in_a_row, 9);
    const Symptoms all = sample.total();
    EXPECT_THAT((std::vector{all.answered, all.silent, all.late}), ElementsAre(10u, 12u, 3u));
    EXPECT_EQ(all.answered_after[0], 10u);
    EXPECT_EQ(all.silent_after[1], 12u);
    EXPECT_EQ(all.mute_in_a_row, 9u) << "of one station, not of all";
    EXPECT_EQ(all.worst_lateness, Duration(80ms));
    EXPECT_EQ(sample.attempts(), 22u);
    EXPECT_EQ(Sample().total(), Symptoms());
}

TEST(Sample, ADriverThatBeganToCountCountsFromZero) {
    Sample before, after;
    after.uart = line::UartErrors{4, 3, 2, 1};
    EXPECT_EQ(difference(after, before).uart, (line::UartErrors{4, 3, 2, 1}));
    EXPECT_FALSE(difference(before, after).uart) << "and one that stopped tells nothing";
}

TEST(Sample, CountersThatBeganAnewCountFromZero) {
    Sample before, after;
    before.stations[1] = Mix().answered(20, 0).silent(5);
    after.stations[1] = Mix().answered(30, 0).silent(1);
    before.uart = line::UartErrors{4, 3, 2, 1};
    after.uart = line::UartErrors{5, 0, 2, 1};
    const Sample window = difference(after, before);
    EXPECT_EQ(window.stations.at(1), after.stations.at(1));
    EXPECT_EQ(window.uart, after.uart);
}

/// Two stations; the test sets the clock and the counts.
class DoctorTest : public testing::Test {
  protected:
    DoctorTest() { doctor.begin(now, counted); }

    Doctor::Change look_after(Duration pause) {
        now += pause;
        return doctor.look(now, sample());
    }
    Sample sample() {
        counted.stations[1] = one;
        return counted;
    }
    /// Five seconds with 20 requests, `damaged` of them unanswered.
    Doctor::Change pass(std::uint64_t damaged) {
        one.answered(20 - damaged).damaged(damaged);
        return look_after(5s);
    }
    static std::string causes(const std::vector<Finding>& findings) {
        std::string list;
        for (const Finding& f : findings) list += std::string(code(f.cause)) + ' ';
        return list;
    }

    TimePoint now{1h};
    Mix one;
    Sample counted;
    Doctor doctor{Settings{}, LineFacts{}};
};

TEST_F(DoctorTest, AFindingAppearsOnceAndGoesOnceWhenTheWindowIsClean) {
    EXPECT_TRUE(pass(0).appeared.empty());
    EXPECT_TRUE(pass(1).appeared.empty());
    EXPECT_EQ(causes(pass(2).appeared), "noise ");
    int steps = 0;
    for (std::size_t gone = 0; steps < 30 && gone == 0; ++steps) {
        const Doctor::Change change = pass(0);
        EXPECT_TRUE(change.appeared.empty());
        gone = change.gone.size();
        EXPECT_LE(gone, 1u);
        EXPECT_EQ(doctor.findings().empty(), gone == 1);
    }
    EXPECT_GE(steps, 60 / 5 - 1);
    EXPECT_LE(steps, 60 / 5 + 2);
}

TEST_F(DoctorTest, WhatIsNearTheLimitDoesNotFlicker) {
    pass(3);
    for (int i = 0; i < 100; ++i) {  // 1 in 240: too little to appear, enough to stay
        const Doctor::Change change = pass(i % 12 == 0 ? 2 : 0);
        EXPECT_EQ(change.appeared.size() + change.gone.size(), 0u) << i;
    }
    EXPECT_EQ(causes(doctor.findings()), "noise ");
}

TEST_F(DoctorTest, TheEvidenceOfAFindingFollowsTheWindow) {
    pass(5);
    const std::string first = doctor.findings().at(0).evidence;
    EXPECT_TRUE(pass(5).appeared.empty());
    EXPECT_NE(doctor.findings().at(0).evidence, first);
}

TEST_F(DoctorTest, AnUnusedLineKeepsItsFindings) {
    pass(5);
    for (int i = 0; i < 100; ++i) EXPECT_TRUE(look_after(1min).gone.empty());
    EXPECT_EQ(doctor.findings().size(), 1u);
}

TEST_F(DoctorTest, ALineThatIsSeldomUsedIsJudgedByALongerWindow) {
    for (int i = 0; i < 12; ++i) {  // one request in half a minute
        (i % 4 == 3 ? one.damaged(1) : one.answered(1));
        look_after(30s);
    }
    EXPECT_EQ(causes(doctor.findings()), "noise ");
}

TEST_F(DoctorTest, ANewLineForgetsTheCountsAndKeepsTheFindingUntilItIsUsed) {
    pass(5);
    doctor.begin(now, counted);
    EXPECT_EQ(doctor.findings().size(), 1u);
    EXPECT_EQ(causes(pass(0).gone), "noise ");
}

TEST_F(DoctorTest, AStationThatWasLeftOutAndIsBackBeginsAnew) {
    LineFacts with, without;
    with.names = {{1, "press"}, {2, "oven"}};
    without.names = {{2, "oven"}};
    doctor.apply(with);
    pass(3);
    doctor.begin(now, counted);
    doctor.apply(without);
    counted.stations.erase(1);
    doctor.apply(with);
    one = Mix();
    EXPECT_TRUE(pass(0).appeared.empty());
    doctor.apply(with);
    EXPECT_EQ(causes(pass(3).appeared), "noise ") << "its counts go on where it stays";
    doctor.begin(now, counted);
    doctor.apply(without);
    doctor.apply(with);
    one = Mix().answered(200).damaged(9);  // more than before already
    EXPECT_THAT(doctor.look(now += 5s, sample()).appeared, testing::IsEmpty());
    EXPECT_THAT(doctor.findings().at(0).evidence, testing::HasSubstr("9 of 209"));
}

TEST_F(DoctorTest, DamageAlonePersistsAcrossOpeningsAndIsNamed) {
    for (int i = 0; i < 6; ++i) {  // one damaged reply, then the line is reopened
        now += 2s;
        counted.stations[1] = one.with(&Symptoms::damaged_long, 1);
        doctor.begin(now, counted);
    }
    EXPECT_FALSE(look_after(5s).appeared.empty());
}

TEST_F(DoctorTest, LooksOnceAStepAndNotBeforeItHasRested) {
    EXPECT_FALSE(doctor.due(now));
    EXPECT_FALSE(doctor.due(now + 5s - 1ns));
    EXPECT_TRUE(doctor.due(now + 5s));
    EXPECT_FALSE(doctor.rested(now + 499ms));
    EXPECT_TRUE(doctor.rested(now + 500ms));
    look_after(1s);
    EXPECT_FALSE(doctor.rested(now + 499ms));
    EXPECT_TRUE(doctor.due(now + 4s)) << "a look between does not move the window";
    const Doctor unborn{Settings{}, LineFacts{}};
    EXPECT_FALSE(unborn.due(now + 1h)) << "the line was never open";
    EXPECT_FALSE(unborn.rested(now + 1h));
}

/// The likeliest and widest cause is the first.
TEST_F(DoctorTest, P10WhatASilenceSaidOfAPanelIsWithdrawnWithTheLine) {
    one.answered(20).with(&Symptoms::requests, 5);
    counted.stations[2] = Mix().silent(9);
    look_after(5s);
    EXPECT_EQ(causes(doctor.findings()), "other-master station-silent ");
    EXPECT_EQ(causes(doctor.withdraw_silence()), "station-silent ");
    EXPECT_EQ(causes(doctor.findings()), "other-master ");
    EXPECT_TRUE(doctor.withdraw_silence().empty());
}

}  // namespace
}  // namespace panelgate::doctor::doctor_test
