// Each cause with the figures that show it, and similar causes.
#include "panelgate/doctor/doctor.hpp"

#include <gmock/gmock.h>

#include "diagnose_case.hpp"

namespace panelgate::doctor::diagnose_test {
namespace {

using arbiter::Symptoms;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST_F(Diagnose, AHealthyLineHasNoFinding) {
    EXPECT_THAT(causes({}), IsEmpty());
    EXPECT_THAT(causes({{1, Mix().answered(100)}, {2, Mix().answered(100, 0)}, {3, {}}}),
                IsEmpty());
    EXPECT_THAT(causes({{1, Mix().answered(999).damaged(1)}}), IsEmpty());
    EXPECT_THAT(causes({{1, Mix().answered(2000).damaged(2)}, {2, Mix().answered(500)}}),
                IsEmpty());
    EXPECT_THAT(causes({{1, Mix().answered(5000).damaged(5)}}), IsEmpty());
    EXPECT_THAT(causes({{1, Mix().answered(500).with(&Symptoms::echoes, 500)}}), IsEmpty());
    EXPECT_THAT(causes({{1, Mix().answered(100).lost(4, 0)}}), IsEmpty());
    EXPECT_THAT(causes({{1, Mix().answered(100).late(1, 30ms)}}), IsEmpty());
}

TEST_F(Diagnose, NoStationAndNoByteIsHeard) {
    EXPECT_THAT(causes({{1, Mix().silent(6)}}), ElementsAre("no-answer-at-all"));
    EXPECT_THAT(causes({{1, Mix().silent(6)}, {2, Mix().silent(9)}, {3, {}}}),
                ElementsAre("no-answer-at-all"));
    EXPECT_THAT(causes({{0, Mix().silent(10)}}), ElementsAre("no-answer-at-all"));
    EXPECT_THAT(causes({{0, Mix().silent(99)}, {1, {}}}), IsEmpty()) << "a scan";
    EXPECT_THAT(causes({{0, Mix().answered(1)}, {1, Mix().silent(9)}}),
                ElementsAre("station-silent 1"));
    EXPECT_THAT(causes({{1, Mix().silent(5)}}), IsEmpty()) << "too early to tell";
    // The cable was cut just now: it has worked within the window.
    EXPECT_THAT(causes({{1, Mix().answered(80).silent(6)}, {2, Mix().answered(80).silent(4)}}),
                ElementsAre("no-answer-at-all"));
    uart = line::UartErrors{0, 0, 0, 7};
    const auto found = findings({{1, Mix().silent(6)}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_THAT(found[0].advice, HasSubstr("Swap the wires A and B"));
    EXPECT_THAT(found[0].advice, HasSubstr("9600 8E1"));
}

TEST_F(Diagnose, OneSilentStationIsNoFaultOfTheLine) {
    EXPECT_THAT(causes({{1, Mix().answered(50)}, {2, Mix().silent(6)}}),
                ElementsAre("station-silent 2"));
    EXPECT_THAT(causes({{1, Mix().answered(50)}, {2, Mix().silent(4)}}), IsEmpty());
    EXPECT_THAT(causes({{1, Mix().answered(50)}, {2, Mix().answered(50).lost(5)}}), IsEmpty());
    EXPECT_THAT(causes({{0, Mix().silent(200)}, {1, Mix().answered(50)}}), IsEmpty())
        << "somebody asks for addresses that nobody has: a scan";
    EXPECT_THAT(causes({{1, Mix().answered(50).silent(1)}, {2, Mix().silent(6)}}), IsEmpty())
        << "the other one is silent, too: perhaps it is the line";
    EXPECT_THAT(causes({{1, Mix().answered(50).silent(1)}, {2, Mix().silent(6)}},
                       {{Cause::station_silent, 2, {}, {}, {}}}),
                ElementsAre("station-silent 2"));
}

TEST_F(Diagnose, OnlyDamageOfEverybodyIsBaudOrParity) {
    EXPECT_THAT(causes({{1, Mix().zeroed(5)}}), ElementsAre("wrong-parity"));
    EXPECT_THAT(causes({{1, Mix().zeroed(9)}, {2, Mix().zeroed(9)}}), ElementsAre("wrong-parity"));
    EXPECT_THAT(causes({{1, Mix().strange(9)}, {2, Mix().strange(9)}}), ElementsAre("wrong-parity"))
        << "the right pace and wrong bytes: data bits";
    EXPECT_THAT(causes({{1, Mix().garbage(9)}, {2, Mix().garbage(9)}}), ElementsAre("wrong-baud"));
    EXPECT_THAT(causes({{1, Mix().garbage(9).lost(20)}}), ElementsAre("wrong-baud"));
    EXPECT_THAT(causes({{1, Mix().garbage(20).answered(2)}}), ElementsAre("wrong-baud"));
    EXPECT_THAT(causes({{1, Mix().garbage(4)}}), ElementsAre("noise")) << "too few to tell";
    EXPECT_THAT(causes({{1, Mix().damaged(9)}, {2, Mix().damaged(9)}}), ElementsAre("noise"))
        << "right beginnings: neither";
    EXPECT_THAT(causes({{1, Mix().garbage(9)}, {2, Mix().answered(9)}}),
                ElementsAre("wrong-baud 1"));
}

TEST_F(Diagnose, WhereAllOfAsciiIsDamagedTheFormatDiffersAndPerhapsTheMode) {
    facts.serial = {9600, 7, Parity::even, 1, SerialMode::ascii};
    const auto found = findings({{1, Mix().garbage(9)}, {2, Mix().strange(9)}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].cause, Cause::wrong_baud);
    EXPECT_NE(found[0].text.find("not Modbus ASCII"), std::string::npos);
    EXPECT_NE(found[0].advice.find("9600 7E1 ASCII"), std::string::npos);
}

TEST_F(Diagnose, WithoutAParityCheckZerosAreNothingSpecial) {
    facts.serial.parity = Parity::none;
    EXPECT_THAT(causes({{1, Mix().long_damaged(9)}}), ElementsAre("noise"));
    EXPECT_THAT(causes({{1, Mix().zeroed(9)}}), ElementsAre("wrong-parity"));
}

TEST_F(Diagnose, TheDriversErrorCountsDecide) {
    uart = line::UartErrors{40, 2, 0, 0};
    EXPECT_THAT(causes({{1, Mix().zeroed(9)}}), ElementsAre("wrong-baud"));
    uart = line::UartErrors{2, 40, 0, 0};
    EXPECT_THAT(causes({{1, Mix().garbage(9)}}), ElementsAre("wrong-parity"));
    EXPECT_THAT(causes({{1, Mix().damaged(9)}}), ElementsAre("wrong-parity"));
    uart = line::UartErrors{40, 2, 0, 60};
    EXPECT_THAT(findings({{1, Mix().garbage(9)}})[0].advice, HasSubstr("swapped"));
    EXPECT_THAT(findings({{1, Mix().garbage(9)}})[0].evidence, HasSubstr("40 framing"));
    uart = line::UartErrors{0, 0, 3, 0};
    EXPECT_THAT(causes({{1, Mix().answered(90).damaged(3)}}), ElementsAre("overrun"));
    EXPECT_THAT(causes({{1, Mix().answered(90)}}), ElementsAre("overrun"));
    EXPECT_THAT(causes({{1, Mix().answered(90).damaged(30)}}), ElementsAre("overrun", "noise"));
    uart = line::UartErrors{1, 1, 1, 1};
    EXPECT_THAT(causes({{1, Mix().answered(90)}}), IsEmpty());
}

TEST_F(Diagnose, SporadicDamageOfEverybodyIsNoise) {
    EXPECT_THAT(causes({{1, Mix().answered(97).damaged(3)}}), ElementsAre("noise"));
    EXPECT_THAT(causes({{1, Mix().answered(100).damaged(4)}, {2, Mix().answered(100).damaged(5)}}),
                ElementsAre("noise"));
    EXPECT_THAT(causes({{1, Mix().answered(10).damaged(10)}}), ElementsAre("noise"));
    EXPECT_THAT(causes({{1, Mix().answered(2)}, {2, Mix().answered(1).damaged(2)}}), IsEmpty());
    EXPECT_THAT(causes({{1, Mix().answered(500).damaged(3)}}), IsEmpty());
    EXPECT_THAT(causes({{1, Mix().answered(500).damaged(3)}}, {{Cause::noise, {}, {}, {}, {}}}),
                ElementsAre("noise"));
    EXPECT_THAT(causes({{1, Mix().answered(500).damaged(1)}}, {{Cause::noise, {}, {}, {}, {}}}),
                IsEmpty());
}

TEST_F(Diagnose, AFewDamagedRepliesOfOneOfTwoStationsAreInconclusive) {
    EXPECT_THAT(causes({{1, Mix().answered(20)}, {2, Mix().answered(20).damaged(3)}}), IsEmpty());
    EXPECT_THAT(causes({{1, Mix().answered(20).damaged(1)}, {2, Mix().answered(20).damaged(3)}}),
                ElementsAre("noise"));
    EXPECT_THAT(causes({{1, Mix().answered(60)}, {2, Mix().answered(20).damaged(3)}}),
                ElementsAre("damaged-replies 2"));
    EXPECT_THAT(causes({{1, Mix().answered(2)}, {2, Mix().answered(20).damaged(9)}}),
                ElementsAre("noise"))
        << "the other one was hardly asked";
}

TEST_F(Diagnose, DamageOfLongRepliesPointsToTheTermination) {
    const Symptoms mixed = Mix().answered(100).long_answered(50).long_damaged(10);
    const auto found = findings({{1, mixed}, {2, Mix().answered(100)}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].cause, Cause::noise) << "nobody else says long ones, so it is not this one";
    EXPECT_THAT(found[0].advice, HasSubstr("termination first"));
    EXPECT_THAT(findings({{1, Mix().answered(90).damaged(9)}})[0].advice,
                Not(HasSubstr("termination first")));
}

TEST_F(Diagnose, UnsolicitedBytesPointToTheBias) {
    const auto found = findings({{1, Mix().answered(60).with(&Symptoms::strays, 20)}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].cause, Cause::noise);
    EXPECT_THAT(found[0].advice, HasSubstr("bias first"));
    EXPECT_THAT(causes({{1, Mix().answered(60).with(&Symptoms::strays, 2)}}), IsEmpty());
}

TEST_F(Diagnose, DamageOrDuplicatesOfOneAddressOnly) {
    const Symptoms fine = Mix().answered(50);
    EXPECT_THAT(causes({{1, fine}, {2, Mix().answered(30).damaged(6)}}),
                ElementsAre("damaged-replies 2"));
    EXPECT_THAT(causes({{1, fine}, {2, Mix().damaged(6)}}), ElementsAre("damaged-replies 2"));
    EXPECT_THAT(causes({{1, fine}, {2, Mix().garbage(6)}}), ElementsAre("wrong-baud 2"));
    EXPECT_THAT(
        causes({{1, fine}, {2, Mix().answered(30).damaged(6).with(&Symptoms::damaged_long, 3)}}),
        ElementsAre("duplicate-address 2"))
        << "replies of a second length, which no cable makes";
    EXPECT_THAT(causes({{1, fine}, {2, Mix().zeroed(6)}}), ElementsAre("wrong-parity 2"));
    EXPECT_THAT(causes({{1, fine}, {2, Mix().answered(30).with(&Symptoms::doubled, 3)}}),
                ElementsAre("duplicate-address 2"));
    EXPECT_THAT(causes({{1, fine}, {2, Mix().lost(3).answered(60).with(&Symptoms::doubled, 3)}}),
                IsEmpty())
        << "late now and then: each repetition is the reply to a retry";
    EXPECT_THAT(causes({{2, Mix().answered(30).damaged(3).with(&Symptoms::doubled, 1)}}),
                ElementsAre("duplicate-address 2"))
        << "alone on its line";
    EXPECT_THAT(causes({{1, fine}, {2, Mix().answered(30).with(&Symptoms::doubled, 1)}}),
                IsEmpty());
    EXPECT_THAT(causes({{1, Mix().answered(50).damaged(6)}, {2, Mix().answered(30).damaged(6)}}),
                ElementsAre("noise"));
}

TEST_F(Diagnose, SilentWhenAskedQuicklyIsAGapTooShort) {
    const Symptoms fine = Mix().answered(50, 0);
    const auto found = findings({{1, fine}, {2, Mix().lost(6, 0).answered(6)}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].cause, Cause::gap_too_short);
    EXPECT_EQ(found[0].station, 2);
    EXPECT_EQ(found[0].advice, "Set its `timing.frame_gap` to 10ms.");
    EXPECT_THAT(
        findings({{2, Mix().lost(6, 0).lost(3, 3).answered(2, 3).answered(6, 5)}})[0].advice,
        HasSubstr("32ms"));
    EXPECT_THAT(causes({{1, fine}, {2, Mix().lost(6, 0).answered(6, 0).answered(20)}}),
                ElementsAre("gap-too-short 2"));
    EXPECT_THAT(causes({{1, fine}, {2, Mix().lost(6, 0).answered(9, 0).answered(20)}}), IsEmpty())
        << "mostly answered";
    EXPECT_THAT(causes({{1, fine}, {2, Mix().lost(6, 0).answered(20).lost(6)}}), IsEmpty())
        << "silent after long pauses, too";
    EXPECT_THAT(causes({{1, fine}, {2, Mix().lost(4, 0).answered(20)}}), IsEmpty());
    EXPECT_THAT(causes({{1, fine}, {2, Mix().lost(6).answered(20, 0)}}), IsEmpty())
        << "the other way round: it was off for a while";
}

TEST_F(Diagnose, LateRepliesAreATimeoutTooShortAndNoGap) {
    facts.response_timeouts[2] = 100ms;
    const auto found =
        findings({{1, Mix().answered(50)}, {2, Mix().lost(6, 0).answered(6).late(6, 41ms)}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].cause, Cause::timeout_too_short);
    EXPECT_EQ(found[0].station, 2);
    EXPECT_EQ(found[0].advice, "Set its `timing.response_timeout` to 180ms.");
    EXPECT_THAT(found[0].evidence,
                HasSubstr("6 replies came up to 41ms after the timeout of 100ms"));
    EXPECT_THAT(causes({{1, Mix().answered(50)}, {2, Mix().silent(9).late(3, 50ms)}}),
                ElementsAre("timeout-too-short 2"));
    EXPECT_THAT(causes({{0, Mix().answered(9).late(3, 50ms)}}), ElementsAre("timeout-too-short"));
}

TEST_F(Diagnose, ForeignRequestsAreAnotherMaster) {
    const Symptoms disturbed = Mix().answered(50).with(&Symptoms::requests, 3);
    EXPECT_THAT(causes({{1, disturbed}}), ElementsAre("other-master"));
    EXPECT_THAT(findings({{1, disturbed}})[0].evidence, HasSubstr("3 requests of another master"));
    EXPECT_THAT(causes({{1, Mix().answered(50).with(&Symptoms::requests, 2)}}), IsEmpty());
    EXPECT_THAT(causes({{1, Mix().answered(50).damaged(5).with(&Symptoms::requests, 9)}}),
                ElementsAre("other-master"))
        << "its frames damage ours";
    EXPECT_THAT(
        causes({{1, Mix().answered(50).with(&Symptoms::requests, 9).with(&Symptoms::doubled, 5)}}),
        ElementsAre("other-master"))
        << "it reads what we read";
    EXPECT_THAT(
        causes({{1, Mix().answered(50).with(&Symptoms::doubled, 9).with(&Symptoms::requests, 3)}}),
        ElementsAre("other-master", "duplicate-address 1"));
    EXPECT_THAT(causes({{1, Mix().answered(9).late(3, 9s).with(&Symptoms::requests, 3)},
                        {2, Mix().answered(9).with(&Symptoms::wrong, 3)}}),
                ElementsAre("other-master"))
        << "what it is answered looks late or wrong";
}

TEST_F(Diagnose, FramesOfStationsThatWereNotAskedAreAnotherMasterToo) {
    const Symptoms fine = Mix().answered(50);
    const Symptoms stranger = Mix().with(&Symptoms::unasked, 3);
    EXPECT_THAT(causes({{0, stranger}, {1, fine}}), ElementsAre("other-master"));
    EXPECT_THAT(causes({{1, fine}, {2, stranger}}), ElementsAre("other-master"));
    EXPECT_THAT(causes({{0, Mix().with(&Symptoms::unasked, 2)}, {1, fine}}), IsEmpty());
    EXPECT_THAT(causes({{0, Mix().silent(9).with(&Symptoms::unasked, 3)}, {1, fine}}), IsEmpty())
        << "those were asked, too";
    broadcasts = 3;
    EXPECT_THAT(causes({{0, stranger}, {1, fine}}), IsEmpty()) << "it may answer the broadcasts";
}

TEST_F(Diagnose, AnEchoThatTheConfigurationDeniesOrInvents) {
    const Symptoms heard = Mix().answered(50).with(&Symptoms::echoes, 3);
    EXPECT_THAT(causes({{1, heard}}), IsEmpty());
    facts.echo = EchoMode::off;
    EXPECT_THAT(causes({{1, heard}}), ElementsAre("echo"));
    EXPECT_THAT(causes({{1, Mix().answered(50).with(&Symptoms::echoes, 2)}}), IsEmpty());
    facts.echo = EchoMode::on;
    EXPECT_THAT(causes({{1, heard}}), IsEmpty());
    EXPECT_THAT(causes({{1, Mix().with(&Symptoms::collided, 6)}}), ElementsAre("echo"));
    EXPECT_THAT(
        causes({{1, Mix().answered(50).with(&Symptoms::echoes, 50).with(&Symptoms::collided, 6)}}),
        ElementsAre("collision"));
}

TEST_F(Diagnose, EveryFindingSaysWhatToDoAndWhy) {
    facts.echo = EchoMode::off;
    uart = line::UartErrors{0, 0, 9, 9};
    std::vector<Finding> all = findings({{1, Mix().silent(9)}});
    const auto more = [&](Stations stations) {
        for (Finding& f : findings(std::move(stations))) all.push_back(std::move(f));
    };
    more({{1, Mix().answered(9).with(&Symptoms::echoes, 9).with(&Symptoms::requests, 9)}});
    more({{1, Mix().answered(20).late(9, 1ms)}, {2, Mix().silent(9)}, {3, Mix().damaged(9)}});
    more({{1, Mix().answered(50).damaged(20)}, {2, Mix().lost(6, 0).answered(6)}});
    more({{1, Mix().damaged(9).with(&Symptoms::crc_swapped, 9)},
          {2, Mix().with(&Symptoms::wrong, 9)},
          {3, Mix().answered(9).with(&Symptoms::trailed, 9)},
          {4, Mix().answered(9).with(&Symptoms::unasked, 9)},
          {5, Mix().lost(9).late(9, 9s)}});
    facts.over_tcp = true;
    more({{1, Mix().damaged(9)}});
    EXPECT_GE(all.size(), 15u);
    for (const Finding& f : all) {
        EXPECT_TRUE(f.text.ends_with(".")) << f.text;
        EXPECT_TRUE(f.advice.ends_with(".")) << f.advice;
        EXPECT_NE(f.evidence.find_first_of("123456789"), std::string::npos) << f.evidence;
        EXPECT_FALSE(f.evidence.ends_with(".")) << f.evidence;
    }
}

}  // namespace
}  // namespace panelgate::doctor::diagnose_test
