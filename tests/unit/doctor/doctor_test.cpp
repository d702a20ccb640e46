#include "panelgate/doctor/doctor.hpp"

#include <gmock/gmock.h>

#include "case.hpp"

namespace panelgate::doctor::doctor_test {
namespace {

using arbiter::Symptoms;

/// Two stations; the test sets the clock and the counts.
class DoctorTest : public testing::Test {
  protected:
    DoctorTest() { doctor.begin(now, counted); }

    /// Five seconds with 20 requests, `damaged` of them unanswered.
    Doctor::Change pass(std::uint64_t damaged) {
        now += 5s;
        one.answered(20 - damaged).damaged(damaged);
        counted.stations[1] = one;
        return doctor.look(now, counted);
    }
    static std::vector<Cause> causes(const std::vector<Finding>& findings) {
        std::vector<Cause> list;
        for (const Finding& f : findings) list.push_back(f.cause);
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
    EXPECT_THAT(causes(pass(2).appeared), testing::ElementsAre(Cause::noise));
    int appeared = 0, gone = 0, steps = 0;
    for (; steps < 30 && gone == 0; ++steps) {
        const Doctor::Change change = pass(0);
        appeared += static_cast<int>(change.appeared.size());
        gone += static_cast<int>(change.gone.size());
        EXPECT_EQ(doctor.findings().empty(), gone == 1);
    }
    EXPECT_EQ(appeared, 0);
    EXPECT_EQ(gone, 1);
    EXPECT_GE(steps, 60 / 5 - 1);
    EXPECT_LE(steps, 60 / 5 + 2);
}

TEST_F(DoctorTest, WhatIsNearTheLimitDoesNotFlicker) {
    pass(3);
    int changes = 0;
    for (int i = 0; i < 100; ++i) {  // 1 in 240: too little to appear, enough to stay
        const Doctor::Change change = pass(i % 12 == 0 ? 2 : 0);
        changes += static_cast<int>(change.appeared.size() + change.gone.size());
    }
    EXPECT_EQ(changes, 0);
    EXPECT_EQ(causes(doctor.findings()), std::vector{Cause::noise});
}

TEST_F(DoctorTest, TheEvidenceOfAFindingFollowsTheWindow) {
    pass(5);
    const std::string first = doctor.findings().at(0).evidence;
    EXPECT_TRUE(pass(5).appeared.empty());
    EXPECT_NE(doctor.findings().at(0).evidence, first);
}

TEST_F(DoctorTest, AnUnusedLineKeepsItsFindings) {
    pass(5);
    for (int i = 0; i < 100; ++i) {
        now += 1min;
        EXPECT_TRUE(doctor.look(now, counted).gone.empty());
    }
    EXPECT_EQ(doctor.findings().size(), 1u);
}

TEST_F(DoctorTest, ALineThatIsSeldomUsedIsJudgedByALongerWindow) {
    for (int i = 0; i < 12; ++i) {  // one request in half a minute
        now += 30s;
        (i % 4 == 3 ? one.damaged(1) : one.answered(1));
        counted.stations[1] = one;
        doctor.look(now, counted);
    }
    EXPECT_EQ(causes(doctor.findings()), std::vector{Cause::noise});
}

TEST_F(DoctorTest, ANewLineForgetsTheCountsAndKeepsTheFindingUntilItIsUsed) {
    pass(5);
    doctor.begin(now, counted);
    EXPECT_EQ(doctor.findings().size(), 1u);
    EXPECT_EQ(causes(pass(0).gone), std::vector{Cause::noise});
}

TEST_F(DoctorTest, DamageAlonePersistsAcrossOpeningsAndIsNamed) {
    for (int i = 0; i < 6; ++i) {  // one damaged reply, then the line is reopened
        now += 2s;
        counted.stations[1] = one.with(&Symptoms::damaged_long, 1);
        doctor.begin(now, counted);
    }
    now += 5s;
    EXPECT_FALSE(doctor.look(now, counted).appeared.empty());
}

TEST_F(DoctorTest, LooksOnceAStepAndNotBeforeItHasRested) {
    EXPECT_FALSE(doctor.due(now));
    EXPECT_FALSE(doctor.due(now + 5s - 1ns));
    EXPECT_TRUE(doctor.due(now + 5s));
    EXPECT_FALSE(doctor.rested(now + 499ms));
    EXPECT_TRUE(doctor.rested(now + 500ms));
    now += 1s;
    doctor.look(now, counted);
    EXPECT_FALSE(doctor.rested(now + 499ms));
    EXPECT_TRUE(doctor.due(now + 4s)) << "a look between does not move the window";
    const Doctor unborn{Settings{}, LineFacts{}};
    EXPECT_FALSE(unborn.due(now + 1h)) << "the line was never open";
    EXPECT_FALSE(unborn.rested(now + 1h));
}

TEST_F(DoctorTest, TheLikeliestAndWidestCauseIsFirst) {
    one.answered(20).with(&Symptoms::requests, 5);
    counted.stations[1] = one;
    counted.stations[2] = Mix().silent(9);
    doctor.look(now + 5s, counted);
    EXPECT_EQ(causes(doctor.findings()), (std::vector{Cause::other_master, Cause::station_silent}));
}

TEST_F(DoctorTest, P10WhatASilenceSaidOfAPanelIsWithdrawnWithTheLine) {
    one.answered(20).with(&Symptoms::requests, 5);
    counted.stations[1] = one;
    counted.stations[2] = Mix().silent(9);
    doctor.look(now + 5s, counted);
    EXPECT_EQ(causes(doctor.withdraw_silence()), std::vector{Cause::station_silent});
    EXPECT_EQ(causes(doctor.findings()), std::vector{Cause::other_master});
    EXPECT_TRUE(doctor.withdraw_silence().empty());
}

}  // namespace
}  // namespace panelgate::doctor::doctor_test
