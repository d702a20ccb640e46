// Faults of one panel, reported as such and as nothing else; and lines over TCP.
#include <gmock/gmock.h>

#include <cstdint>

#include "case.hpp"
#include "panelgate/doctor/doctor.hpp"

namespace panelgate::doctor::panel_rules_test {
namespace {

using arbiter::Symptoms;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// Right except for the order of the CRC's bytes.
Mix swapped(std::uint64_t n) { return Mix().damaged(n).with(&Symptoms::crc_swapped, n); }
/// Good frames that do not answer.
Mix wrong(std::uint64_t n) { return Mix().with(&Symptoms::wrong, n); }
/// Fifty replies, some of them twice.
Mix doubled(std::uint64_t n) { return Mix().answered(50).with(&Symptoms::doubled, n); }

/// The other order would damage those that are right now.
TEST_F(Diagnose, SomeRepliesWithTheCrcsBytesSwappedAreNoWrongOrder) {
    Mix some = swapped(8);
    EXPECT_EQ(alone(some.answered(7)), "wrong-crc-order 1");
    EXPECT_THAT(alone(some.answered(33)), Not(HasSubstr("crc-order")));
}

TEST_F(Diagnose, ForAPanelThatWritesInLowerCaseTheSettingIsNamed) {
    const Mix panel = Mix().answered(4).damaged(6).with(&Symptoms::lower_case, 6);
    facts.serial.mode = SerialMode::ascii;
    EXPECT_THAT(only("ascii-lower-case 7", {{7, panel}, {8, Mix().answered(20)}}).advice,
                HasSubstr("serial: {ascii_lower_case: take}"));
    EXPECT_EQ(alone(Mix().damaged(6).with(&Symptoms::lower_case, 6)), "ascii-lower-case 1")
        << "all of it is explained";
    EXPECT_EQ(alone(Mix().answered(4).damaged(6).with(&Symptoms::lower_case, 2)), "noise");
}

TEST_F(Diagnose, APanelWhoseAsciiBeginsOrEndsOtherwiseIsNoNoise) {
    const Mix panel = Mix().damaged(6).with(&Symptoms::delimited, 6);
    facts.serial.mode = SerialMode::ascii;
    EXPECT_THAT(only("ascii-delimiters 7", {{7, panel}, {8, Mix().answered(20)}}).advice,
                HasSubstr("08 00 03 0A 00"));
    EXPECT_EQ(alone(panel), "ascii-delimiters 1");
    facts.serial.mode = SerialMode::rtu;
    EXPECT_THAT(alone(panel), Not(HasSubstr("ascii")));
}

TEST_F(Diagnose, AFewLateRepliesAmongManyAreNoTimeoutTooShort) {
    const Symptoms seldom = Mix().answered(28).lost(3).late(3, 300ms);
    EXPECT_EQ(alone(Mix().answered(97).lost(3).late(3, 300ms)), "");
    EXPECT_EQ(alone(Mix().answered(27).lost(3).late(3, 300ms)), "timeout-too-short 1");
    EXPECT_EQ(alone(Mix().answered(30).lost(3).late(9, 300ms)), "") << "none was owed";
    EXPECT_EQ(alone(seldom), "");
    EXPECT_EQ(causes({{1, seldom}}, {known(Cause::timeout_too_short, 1)}), "timeout-too-short 1");
    EXPECT_EQ(alone(Mix().answered(2).late(2, 300ms)), "") << "too little to tell";
}

/// Of 20 outstanding replies of station 2 six were heard late, and 14 not at all.
TEST_F(Diagnose, OnlyDamageBeyondUnheardLateRepliesIsEvidence) {
    const Symptoms busy = Mix().answered(400);
    const Symptoms late = Mix().silent(20).late(6, 700ms);
    const auto hit = [](unsigned n) { return Mix().answered(192).damaged(n); };
    EXPECT_EQ(causes({{1, busy}, {2, late}, {4, hit(16)}}), "timeout-too-short 2");
    EXPECT_EQ(causes({{1, busy}, {2, late}, {4, hit(17)}}),
              "damaged-replies 4, timeout-too-short 2");
    EXPECT_EQ(causes({{1, busy}, {2, Mix().silent(20)}, {4, hit(8)}}),
              "damaged-replies 4, station-silent 2")
        << "it is off: nothing comes late";
    const Symptoms both = Mix().answered(100).silent(20).late(6, 700ms).damaged(8);
    EXPECT_EQ(causes({{1, busy}, {2, both}}), "damaged-replies 2")
        << "its own late replies do not meet each other";
    const Symptoms noisy = Mix().answered(400).damaged(15);
    EXPECT_EQ(causes({{1, noisy}, {2, Mix().silent(90).late(1, 700ms)}, {4, noisy}}),
              "noise, station-silent 2")
        << "one late reply explains no 30";
}

TEST_F(Diagnose, OneVeryLateReplyGivesNoFigureForTheTimeout) {
    EXPECT_EQ(alone(Mix().answered(20).lost(1).late(3, 11300ms)), "");
    const Finding found = only("timeout-too-short 1", {{1, Mix().lost(6).late(6, 11300ms)}});
    EXPECT_THAT(found.advice, Not(HasSubstr("11"))) << "it is always late";
    EXPECT_THAT(found.evidence, HasSubstr("up to 11300ms after the timeout of 500ms"));
}

TEST_F(Diagnose, ATimeoutThatTheDeadlineCutsShortIsReportedWithIt) {
    facts.deadline = 2s;
    EXPECT_EQ(findings({{1, Mix().lost(6).late(6, 1s)}}).at(0).advice,
              "Set its `timing.response_timeout` to 1880ms.");
    EXPECT_EQ(findings({{1, Mix().lost(6).late(6, 1500ms)}}).at(0).advice,
              "Set its `timing.response_timeout` to 2500ms, and `queue.deadline` above that (now "
              "2000ms).");
}

TEST_F(Diagnose, ACrcWithItsHighByteFirstIsNeitherNoiseNorASecondPanel) {
    EXPECT_THAT(only("wrong-crc-order 2", {{1, fine}, {2, swapped(9)}}).evidence,
                HasSubstr("9 of 9 damaged replies (100 %)"));
    EXPECT_EQ(alone(swapped(9)), "wrong-crc-order 1");
    EXPECT_EQ(alone(swapped(9).with(&Symptoms::doubled, 4)), "wrong-crc-order 1");
    EXPECT_EQ(causes({{1, swapped(9)}, {2, swapped(9)}}), "wrong-crc-order 1, wrong-crc-order 2");
    EXPECT_EQ(beside(swapped(2)), "");
    EXPECT_EQ(beside(swapped(3).damaged(6)), "damaged-replies 2") << "most of it is other damage";
    EXPECT_EQ(causes({{1, Mix().answered(50).damaged(6)}, {2, swapped(9)}}),
              "noise, wrong-crc-order 2");
}

TEST_F(Diagnose, AdviceOnTheCrcOrderFollowsWhatIsSet) {
    const Finding high = findings({{2, swapped(9)}}).at(0);
    EXPECT_THAT(high.text, HasSubstr("high byte first"));
    EXPECT_THAT(high.advice, HasSubstr("Set its `crc_order: high_first`"));
    EXPECT_THAT(findings({{0, swapped(9)}}).at(0).advice, HasSubstr("List it"));
    facts.crc_high_first = {2};
    const Finding low = findings({{2, swapped(9)}}).at(0);
    EXPECT_THAT(low.text, HasSubstr("low byte first"));
    EXPECT_THAT(low.advice, HasSubstr("Leave its `crc_order` out"));
}

TEST_F(Diagnose, AnExceptionOfAnotherFunctionIsNeitherAMasterNorSilence) {
    Mix odd = wrong(9).with(&Symptoms::wrong_exceptions, 9);
    odd.with(&Symptoms::unasked, 9).with(&Symptoms::mute_in_a_row, 9);
    EXPECT_THAT(only("wrong-exception 2", {{1, fine}, {2, odd}}).evidence,
                HasSubstr("9 of 9 requests (100 %)"));
    EXPECT_EQ(beside(wrong(9).answered(50).with(&Symptoms::wrong_exceptions, 3)), "wrong-reply 2")
        << "most of it is something else";
}

TEST_F(Diagnose, SilenceFromTheStartMayBeTheOrderOfTheCrc) {
    const auto advice = [&](const Symptoms& s) {
        return findings({{1, fine}, {2, s}}).at(0).advice;
    };
    EXPECT_THAT(advice(Mix().silent(9)), HasSubstr("`crc_order: high_first`"));
    EXPECT_THAT(advice(Mix().answered(9).silent(9)), Not(HasSubstr("crc_order")));
    facts.crc_high_first = {2};
    EXPECT_THAT(advice(Mix().silent(9)), Not(HasSubstr("crc_order")));
}

TEST_F(Diagnose, APanelThatAnswersBroadcastsIsNamed) {
    broadcasts = 8;
    const auto answers = [](unsigned n) {
        return Mix().answered(50).with(&Symptoms::broadcast_replies, n);
    };
    EXPECT_EQ(beside(answers(8)), "answers-broadcasts 2");
    EXPECT_EQ(causes({{1, answers(4)}, {2, answers(8)}}),
              "answers-broadcasts 1, answers-broadcasts 2");
    EXPECT_EQ(beside(answers(2)), "") << "may be chance";
    broadcasts = 100;
    EXPECT_EQ(beside(answers(20)), "") << "it is silent as a rule";
}

TEST_F(Diagnose, GoodFramesThatDoNotAnswerAreAWrongReply) {
    const Symptoms not_silent = wrong(9).with(&Symptoms::mute_in_a_row, 9);
    const Finding found = only("wrong-reply 2", {{1, fine}, {2, wrong(9)}});
    EXPECT_THAT(found.advice, HasSubstr("any_length: true"));
    EXPECT_EQ(found.text, "Station 2 answers with frames that do not fit the request.");
    EXPECT_EQ(found.evidence, "9 of 9 requests (100 %) were answered so, 0 rightly");
    EXPECT_EQ(beside(not_silent), "wrong-reply 2");
    EXPECT_EQ(alone(not_silent), "wrong-reply 1");
    EXPECT_EQ(beside(wrong(9).with(&Symptoms::unasked, 9)), "wrong-reply 2");
    EXPECT_EQ(causes({{0, wrong(9)}, {1, fine}}), "wrong-reply");
    EXPECT_EQ(alone(wrong(2).answered(10)), "");
    EXPECT_EQ(alone(wrong(3).answered(100)), "");
}

TEST_F(Diagnose, BytesBehindMostRepliesAreNoNoise) {
    const auto tail = [](unsigned n) {
        return Mix().answered(50).with(&Symptoms::trailed, n).with(&Symptoms::strays, n);
    };
    EXPECT_THAT(only("trailing-bytes 2", {{1, fine}, {2, tail(50)}}).advice,
                HasSubstr("`timing.frame_gap`"));
    EXPECT_EQ(causes({{1, tail(50)}, {2, tail(40)}}), "trailing-bytes") << "of all: the line's";
    EXPECT_EQ(alone(tail(50)), "trailing-bytes 1");
    EXPECT_EQ(alone(tail(50).with(&Symptoms::strays, 30)), "noise, trailing-bytes 1")
        << "bytes come elsewhere, too";
    EXPECT_EQ(alone(tail(20)), "noise") << "now and then: chance";
    EXPECT_EQ(alone(tail(2)), "");
    EXPECT_EQ(alone(Mix().answered(4).with(&Symptoms::trailed, 4)), "");
}

TEST_F(Diagnose, ADuplicateAfterEveryReplyMayBeOnePanelOrTwo) {
    EXPECT_THAT(only("duplicate-address 1", {{1, doubled(50).with(&Symptoms::trailed, 50)}}).advice,
                HasSubstr("sends everything twice"));
}

TEST_F(Diagnose, OneReplyThatCameTwiceOnANoisyLineIsNoSecondPanel) {
    EXPECT_EQ(causes({{1, Mix().answered(50).damaged(6)}, {2, doubled(1).damaged(6)}}), "noise");
    const Symptoms twice = Mix().answered(30).with(&Symptoms::doubled, 3);
    EXPECT_THAT(findings({{1, Mix().answered(90)}, {2, twice}}).at(0).evidence,
                HasSubstr("the other stations are fine"));
    EXPECT_THAT(findings({{2, twice}}).at(0).evidence, Not(HasSubstr("the other stations")));
}

TEST_F(Diagnose, APanelThatSpeaksUnaskedIsNoMaster) {
    const Symptoms talker = Mix().answered(50).with(&Symptoms::unasked, 9);
    EXPECT_EQ(beside(talker), "unasked-frames 2");
    EXPECT_THAT(findings({{2, talker}})[0].advice, Not(HasSubstr("broadcast")));
    broadcasts = 9;
    EXPECT_THAT(findings({{2, talker}})[0].advice, HasSubstr("may answer broadcasts"));
    EXPECT_EQ(alone(Mix().answered(50).with(&Symptoms::unasked, 4)), "");
    EXPECT_EQ(alone(Mix().answered(500).with(&Symptoms::unasked, 9)), "");
}

class DiagnoseOverTcp : public Diagnose {
  protected:
    DiagnoseOverTcp() { facts.over_tcp = true; }
};

TEST_F(DiagnoseOverTcp, AHealthyLineHasNoFinding) {
    EXPECT_EQ(causes({{1, Mix().answered(100)}, {2, Mix().answered(999).damaged(1)}}), "");
}

TEST_F(DiagnoseOverTcp, DamageIsAMatterOfTheServer) {
    const Symptoms longer = Mix().answered(80).with(&Symptoms::damaged_long, 5);
    for (const Stations& stations :
         {Stations{{1, Mix().garbage(9)}}, Stations{{1, longer}, {2, longer}},
          Stations{{1, Mix().with(&Symptoms::damaged_short, 9)}}}) {
        const Finding found = only("tcp-framing", stations);
        EXPECT_THAT(found.advice, HasSubstr("telnet"));
        EXPECT_THAT(found.advice, Not(AnyOf(HasSubstr("termination"), HasSubstr("parity"))));
    }
}

TEST_F(DiagnoseOverTcp, TelnetIsNamedAtOnceAndDamageBesideItIsItsOwn) {
    telnet = true;
    EXPECT_THAT(only("telnet", {}).advice, HasSubstr("raw TCP"));
    const Symptoms beheaded =
        Mix().answered(20).garbage(30).with(&Symptoms::beheaded, 30).with(&Symptoms::strays, 30);
    EXPECT_EQ(causes({{1, beheaded}, {2, beheaded}}), "telnet");
    EXPECT_EQ(causes({{1, Mix().garbage(30)}, {2, fine}}), "telnet");
    EXPECT_EQ(causes({{1, Mix().silent(9)}}), "telnet, no-answer-at-all")
        << "the baud may be wrong, too";
}

TEST_F(DiagnoseOverTcp, ASilentLineMayBeAServerThatSpeaksModbusTcp) {
    EXPECT_THAT(only("no-answer-at-all", {{1, Mix().silent(9)}}).advice,
                HasSubstr("raw or transparent, not Modbus/TCP"));
}

TEST_F(DiagnoseOverTcp, RightLengthsAreNotWhatFramingChanges) {
    const Symptoms hit = Mix().answered(297).damaged(3);
    EXPECT_THAT(only("noise", {{1, hit}, {2, hit}}).advice, HasSubstr("behind the server"));
    EXPECT_EQ(alone(hit), "noise");
    EXPECT_THAT(only("wrong-parity", {{1, Mix().zeroed(9)}}).advice,
                HasSubstr("the server's serial port"));
}

TEST_F(DiagnoseOverTcp, AConnectionThatStallsIsNoNoise) {
    const Symptoms stalled =
        Mix().answered(60).lost(9).with(&Symptoms::damaged_short, 3).with(&Symptoms::strays, 9);
    EXPECT_EQ(causes({{1, stalled}, {2, stalled}}), "");
    EXPECT_EQ(causes({{1, stalled}, {2, Mix().answered(200)}}), "");
    EXPECT_EQ(alone(Mix().with(&Symptoms::damaged_short, 5).lost(9)), "");
    EXPECT_EQ(causes({{1, Mix().answered(60).silent(9)}, {2, Mix().answered(60).silent(9)}}),
              "no-answer-at-all");
}

TEST_F(DiagnoseOverTcp, AdviceIsAboutTheServerAndNotAboutWires) {
    const Finding found = only("no-answer-at-all", {{1, Mix().silent(9)}});
    EXPECT_THAT(found.advice, HasSubstr("server"));
    EXPECT_THAT(found.advice, Not(AnyOf(HasSubstr("wires"), HasSubstr("bias"))));
    EXPECT_EQ(beside(Mix().zeroed(9)), "damaged-replies 2") << "the line's parity is the server's";
}

}  // namespace
}  // namespace panelgate::doctor::panel_rules_test
