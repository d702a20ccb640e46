// Faults of one panel, reported as such and as nothing else; and lines over TCP.
#include <gmock/gmock.h>

#include "diagnose_case.hpp"

namespace panelgate::doctor::panel_rules_test {
namespace {

using arbiter::Symptoms;
using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Right except for the order of the CRC's bytes.
Mix swapped(std::uint64_t n) { return Mix().damaged(n).with(&Symptoms::crc_swapped, n); }

TEST_F(Diagnose, ForAPanelThatWritesInLowerCaseTheSettingIsNamed) {
    const Mix panel = Mix().answered(4).damaged(6).with(&Symptoms::lower_case, 6);
    facts.serial.mode = SerialMode::ascii;
    const auto found = findings({{7, panel}, {8, Mix().answered(20)}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].cause, Cause::ascii_lower_case);
    EXPECT_EQ(found[0].station, 7);
    EXPECT_THAT(found[0].advice, HasSubstr("serial: {ascii_lower_case: take}"));
    EXPECT_THAT(causes({{7, Mix().damaged(6).with(&Symptoms::lower_case, 6)}}),
                ElementsAre("ascii-lower-case 7"))
        << "all of it is explained";
    EXPECT_THAT(causes({{7, Mix().answered(4).damaged(6).with(&Symptoms::lower_case, 2)}}),
                ElementsAre("noise"));
}

TEST_F(Diagnose, AFewLateRepliesAmongManyAreNoTimeoutTooShort) {
    EXPECT_THAT(causes({{1, Mix().answered(100).late(3, 300ms)}}), IsEmpty());
    EXPECT_THAT(causes({{1, Mix().answered(30).late(3, 300ms)}}),
                ElementsAre("timeout-too-short 1"));
    EXPECT_THAT(causes({{1, Mix().answered(31).late(3, 300ms)}}), IsEmpty());
    EXPECT_THAT(causes({{1, Mix().answered(31).late(3, 300ms)}},
                       {{Cause::timeout_too_short, 1, {}, {}, {}}}),
                ElementsAre("timeout-too-short 1"));
    EXPECT_THAT(causes({{1, Mix().answered(2).late(2, 300ms)}}), IsEmpty()) << "too little to tell";
}

TEST_F(Diagnose, OneVeryLateReplyGivesNoFigureForTheTimeout) {
    EXPECT_THAT(causes({{1, Mix().answered(20).lost(1).late(3, 11300ms)}}), IsEmpty());
    const auto found = findings({{1, Mix().lost(6).late(6, 11300ms)}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].cause, Cause::timeout_too_short) << "it is always late";
    EXPECT_THAT(found[0].advice, Not(HasSubstr("11")));
    EXPECT_THAT(found[0].evidence, HasSubstr("up to 11300ms after the timeout of 500ms"));
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
    const Symptoms fine = Mix().answered(50);
    const auto found = findings({{1, fine}, {2, swapped(9)}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].cause, Cause::wrong_crc_order);
    EXPECT_EQ(found[0].station, 2);
    EXPECT_THAT(found[0].evidence, HasSubstr("9 of 9 damaged replies (100 %)"));
    EXPECT_THAT(causes({{2, swapped(9)}}), ElementsAre("wrong-crc-order 2")) << "alone";
    EXPECT_THAT(causes({{2, swapped(9).with(&Symptoms::doubled, 4)}}),
                ElementsAre("wrong-crc-order 2"));
    EXPECT_THAT(causes({{1, swapped(9)}, {2, swapped(9)}}),
                ElementsAre("wrong-crc-order 1", "wrong-crc-order 2"));
    EXPECT_THAT(causes({{1, fine}, {2, swapped(2)}}), IsEmpty());
    EXPECT_THAT(causes({{1, fine}, {2, swapped(3).damaged(6)}}), ElementsAre("damaged-replies 2"))
        << "most of it is other damage";
    EXPECT_THAT(causes({{1, Mix().answered(50).damaged(6)}, {2, swapped(9)}}),
                ElementsAre("noise", "wrong-crc-order 2"));
}

TEST_F(Diagnose, AdviceOnTheCrcOrderFollowsWhatIsSet) {
    EXPECT_THAT(findings({{2, swapped(9)}}).at(0).text, HasSubstr("high byte first"));
    EXPECT_THAT(findings({{2, swapped(9)}}).at(0).advice,
                HasSubstr("Set its `crc_order: high_first`"));
    EXPECT_THAT(findings({{0, swapped(9)}}).at(0).advice, HasSubstr("List it"));
    facts.crc_high_first = {2};
    EXPECT_THAT(findings({{2, swapped(9)}}).at(0).text, HasSubstr("low byte first"));
    EXPECT_THAT(findings({{2, swapped(9)}}).at(0).advice, HasSubstr("Leave its `crc_order` out"));
}

TEST_F(Diagnose, AnExceptionOfAnotherFunctionIsNeitherAMasterNorSilence) {
    const Symptoms fine = Mix().answered(50);
    const Symptoms odd = Mix()
                             .with(&Symptoms::wrong, 9)
                             .with(&Symptoms::wrong_exceptions, 9)
                             .with(&Symptoms::unasked, 9)
                             .with(&Symptoms::mute_in_a_row, 9);
    const auto found = findings({{1, fine}, {2, odd}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].cause, Cause::wrong_exception);
    EXPECT_EQ(found[0].station, 2);
    EXPECT_THAT(found[0].evidence, HasSubstr("9 of 9 requests (100 %)"));
    EXPECT_THAT(
        causes(
            {{1, fine},
             {2,
              Mix().answered(50).with(&Symptoms::wrong, 9).with(&Symptoms::wrong_exceptions, 3)}}),
        ElementsAre("wrong-reply 2"))
        << "most of it is something else";
}

TEST_F(Diagnose, SilenceFromTheStartMayBeTheOrderOfTheCrc) {
    const Symptoms fine = Mix().answered(50);
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
    const Symptoms fine = Mix().answered(50);
    const auto answers = [](std::uint64_t n) {
        return Mix().answered(50).with(&Symptoms::broadcast_replies, n);
    };
    EXPECT_THAT(causes({{1, fine}, {2, answers(8)}}), ElementsAre("answers-broadcasts 2"));
    EXPECT_THAT(causes({{1, answers(4)}, {2, answers(8)}}),
                ElementsAre("answers-broadcasts 1", "answers-broadcasts 2"));
    EXPECT_THAT(causes({{1, fine}, {2, answers(2)}}), IsEmpty()) << "may be chance";
    broadcasts = 100;
    EXPECT_THAT(causes({{1, fine}, {2, answers(20)}}), IsEmpty()) << "it is silent as a rule";
}

TEST_F(Diagnose, GoodFramesThatDoNotAnswerAreAWrongReply) {
    const Symptoms fine = Mix().answered(50);
    const Symptoms odd = Mix().with(&Symptoms::wrong, 9).with(&Symptoms::unasked, 9);
    const auto found = findings({{1, fine}, {2, Mix().with(&Symptoms::wrong, 9)}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].cause, Cause::wrong_reply);
    EXPECT_EQ(found[0].text, "Station 2 answers with frames that do not fit the request.");
    EXPECT_EQ(found[0].evidence, "9 of 9 requests (100 %) were answered so, 0 rightly");
    EXPECT_THAT(
        causes({{1, fine}, {2, Mix().with(&Symptoms::wrong, 9).with(&Symptoms::mute_in_a_row, 9)}}),
        ElementsAre("wrong-reply 2"))
        << "it is not silent";
    EXPECT_THAT(causes({{2, Mix().with(&Symptoms::wrong, 9).with(&Symptoms::mute_in_a_row, 9)}}),
                ElementsAre("wrong-reply 2"));
    EXPECT_THAT(causes({{1, fine}, {2, odd}}), ElementsAre("wrong-reply 2"));
    EXPECT_THAT(causes({{0, Mix().with(&Symptoms::wrong, 9)}, {1, fine}}),
                ElementsAre("wrong-reply"));
    EXPECT_THAT(causes({{1, Mix().answered(10).with(&Symptoms::wrong, 2)}}), IsEmpty());
    EXPECT_THAT(causes({{1, Mix().answered(100).with(&Symptoms::wrong, 3)}}), IsEmpty());
}

TEST_F(Diagnose, BytesBehindMostRepliesAreNoNoise) {
    const Symptoms fine = Mix().answered(50);
    const auto tail = [](std::uint64_t n) {
        return Mix().answered(50).with(&Symptoms::trailed, n).with(&Symptoms::strays, n);
    };
    const auto found = findings({{1, fine}, {2, tail(50)}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].cause, Cause::trailing_bytes);
    EXPECT_EQ(found[0].station, 2);
    EXPECT_THAT(found[0].advice, HasSubstr("`timing.frame_gap`"));
    EXPECT_THAT(causes({{1, tail(50)}, {2, tail(40)}}), ElementsAre("trailing-bytes"))
        << "of all: the line's";
    EXPECT_THAT(causes({{1, tail(50)}}), ElementsAre("trailing-bytes 1"));
    EXPECT_THAT(causes({{1, tail(50).with(&Symptoms::strays, 30)}}),
                ElementsAre("noise", "trailing-bytes 1"))
        << "bytes come elsewhere, too";
    EXPECT_THAT(causes({{1, tail(20)}}), ElementsAre("noise")) << "now and then: chance";
    EXPECT_THAT(causes({{1, tail(2)}}), IsEmpty());
    EXPECT_THAT(causes({{1, Mix().answered(4).with(&Symptoms::trailed, 4)}}), IsEmpty());
}

TEST_F(Diagnose, ADuplicateAfterEveryReplyMayBeOnePanelOrTwo) {
    const auto found = findings(
        {{1, Mix().answered(50).with(&Symptoms::doubled, 50).with(&Symptoms::trailed, 50)}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].cause, Cause::duplicate_address);
    EXPECT_THAT(found[0].advice, HasSubstr("sends everything twice"));
}

TEST_F(Diagnose, OneReplyThatCameTwiceOnANoisyLineIsNoSecondPanel) {
    const Symptoms noisy = Mix().answered(50).damaged(6);
    EXPECT_THAT(
        causes({{1, noisy}, {2, Mix().answered(50).damaged(6).with(&Symptoms::doubled, 1)}}),
        ElementsAre("noise"));
    EXPECT_THAT(
        findings({{1, Mix().answered(90)}, {2, Mix().answered(30).with(&Symptoms::doubled, 3)}})
            .at(0)
            .evidence,
        HasSubstr("the other stations are fine"));
    EXPECT_THAT(findings({{2, Mix().answered(30).with(&Symptoms::doubled, 3)}}).at(0).evidence,
                Not(HasSubstr("the other stations")));
}

TEST_F(Diagnose, APanelThatSpeaksUnaskedIsNoMaster) {
    const Symptoms fine = Mix().answered(50);
    const Symptoms talker = Mix().answered(50).with(&Symptoms::unasked, 9);
    EXPECT_THAT(causes({{1, fine}, {2, talker}}), ElementsAre("unasked-frames 2"));
    EXPECT_THAT(findings({{2, talker}})[0].advice, Not(HasSubstr("broadcast")));
    broadcasts = 9;
    EXPECT_THAT(findings({{2, talker}})[0].advice, HasSubstr("may answer broadcasts"));
    EXPECT_THAT(causes({{2, Mix().answered(50).with(&Symptoms::unasked, 4)}}), IsEmpty());
    EXPECT_THAT(causes({{2, Mix().answered(500).with(&Symptoms::unasked, 9)}}), IsEmpty());
}

class DiagnoseOverTcp : public Diagnose {
  protected:
    DiagnoseOverTcp() { facts.over_tcp = true; }
};

TEST_F(DiagnoseOverTcp, AHealthyLineHasNoFinding) {
    EXPECT_THAT(causes({{1, Mix().answered(100)}, {2, Mix().answered(999).damaged(1)}}), IsEmpty());
}

TEST_F(DiagnoseOverTcp, DamageIsAMatterOfTheServer) {
    for (const Stations& stations :
         {Stations{{1, Mix().garbage(9)}},
          Stations{{1, Mix().answered(80).with(&Symptoms::damaged_long, 5)},
                   {2, Mix().answered(80).with(&Symptoms::damaged_long, 5)}},
          Stations{{1, Mix().with(&Symptoms::damaged_short, 9)}}}) {
        const auto found = findings(stations);
        ASSERT_EQ(found.size(), 1u);
        EXPECT_EQ(code(found[0].cause), "tcp-framing");
        EXPECT_THAT(found[0].advice, HasSubstr("telnet"));
        EXPECT_THAT(found[0].advice, Not(AnyOf(HasSubstr("termination"), HasSubstr("parity"))));
    }
}

TEST_F(DiagnoseOverTcp, RightLengthsAreNotWhatFramingChanges) {
    const Symptoms hit = Mix().answered(297).damaged(3);
    const auto found = findings({{1, hit}, {2, hit}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].cause, Cause::noise);
    EXPECT_THAT(found[0].advice, HasSubstr("behind the server"));
    EXPECT_THAT(causes({{1, hit}}), ElementsAre("noise"));
    const auto never = findings({{1, Mix().zeroed(9)}});
    ASSERT_EQ(never.size(), 1u);
    EXPECT_EQ(never[0].cause, Cause::wrong_parity);
    EXPECT_THAT(never[0].advice, HasSubstr("the server's serial port"));
}

TEST_F(DiagnoseOverTcp, AConnectionThatStallsIsNoNoise) {
    const Symptoms stalled =
        Mix().answered(60).lost(9).with(&Symptoms::damaged_short, 3).with(&Symptoms::strays, 9);
    EXPECT_THAT(causes({{1, stalled}, {2, stalled}}), IsEmpty());
    EXPECT_THAT(causes({{1, stalled}, {2, Mix().answered(200)}}), IsEmpty());
    EXPECT_THAT(causes({{1, Mix().with(&Symptoms::damaged_short, 5).lost(9)}}), IsEmpty());
    EXPECT_THAT(causes({{1, Mix().answered(60).silent(9)}, {2, Mix().answered(60).silent(9)}}),
                ElementsAre("no-answer-at-all"));
}

TEST_F(DiagnoseOverTcp, AdviceIsAboutTheServerAndNotAboutWires) {
    const auto found = findings({{1, Mix().silent(9)}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_THAT(found[0].advice, HasSubstr("server"));
    EXPECT_THAT(found[0].advice, Not(AnyOf(HasSubstr("wires"), HasSubstr("bias"))));
    EXPECT_THAT(causes({{1, Mix().answered(50)}, {2, Mix().zeroed(9)}}),
                ElementsAre("damaged-replies 2"))
        << "the line's parity is the server's";
}

}  // namespace
}  // namespace panelgate::doctor::panel_rules_test
