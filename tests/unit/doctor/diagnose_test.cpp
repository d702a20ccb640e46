// Each cause with the figures that show it, and similar causes; then each plain fault alone.
#include <gmock/gmock.h>

#include <string>
#include <utility>
#include <vector>

#include "case.hpp"
#include "panelgate/doctor/doctor.hpp"

namespace panelgate::doctor::diagnose_test {
namespace {

using arbiter::Symptoms;
using ::testing::HasSubstr;

TEST_F(Diagnose, AHealthyLineHasNoFinding) {
    EXPECT_EQ(causes({}), "");
    EXPECT_EQ(causes({{1, Mix().answered(100)}, {2, Mix().answered(100, 0)}, {3, {}}}), "");
    EXPECT_EQ(causes({{1, Mix().answered(2000).damaged(2)}, {2, Mix().answered(500)}}), "");
    EXPECT_EQ(alone(Mix().answered(999).damaged(1)), "");
    EXPECT_EQ(alone(Mix().answered(5000).damaged(5)), "");
    EXPECT_EQ(alone(Mix().answered(500).with(&Symptoms::echoes, 500)), "");
    EXPECT_EQ(alone(Mix().answered(100).lost(4, 0)), "");
    EXPECT_EQ(alone(Mix().answered(100).late(1, 30ms)), "");
}

TEST_F(Diagnose, NoStationAndNoByteIsHeard) {
    EXPECT_EQ(alone(Mix().silent(6)), "no-answer-at-all");
    EXPECT_EQ(causes({{1, Mix().silent(6)}, {2, Mix().silent(9)}, {3, {}}}), "no-answer-at-all");
    EXPECT_EQ(causes({{0, Mix().silent(10)}}), "no-answer-at-all");
    EXPECT_EQ(causes({{0, Mix().silent(99)}, {1, {}}}), "") << "a scan";
    EXPECT_EQ(causes({{0, Mix().answered(1)}, {1, Mix().silent(9)}}), "station-silent 1");
    EXPECT_EQ(alone(Mix().silent(5)), "") << "too early to tell";
    // The cable was cut just now: it has worked within the window.
    EXPECT_EQ(causes({{1, Mix().answered(80).silent(6)}, {2, Mix().answered(80).silent(4)}}),
              "no-answer-at-all");
    uart = line::UartErrors{0, 0, 0, 7};
    const Finding found = only("no-answer-at-all", {{1, Mix().silent(6)}});
    EXPECT_THAT(found.advice, HasSubstr("Swap the wires A and B"));
    EXPECT_THAT(found.advice, HasSubstr("9600 8E1"));
}

TEST_F(Diagnose, OneSilentStationIsNoFaultOfTheLine) {
    EXPECT_EQ(beside(Mix().silent(6)), "station-silent 2");
    EXPECT_EQ(beside(Mix().silent(4)), "");
    EXPECT_EQ(beside(Mix().answered(50).lost(5)), "");
    EXPECT_EQ(causes({{0, Mix().silent(200)}, {1, fine}}), "")
        << "somebody asks for addresses that nobody has: a scan";
    const Stations both{{1, Mix().answered(50).silent(1)}, {2, Mix().silent(6)}};
    EXPECT_EQ(causes(both), "") << "the other one is silent, too: perhaps it is the line";
    EXPECT_EQ(causes(both, {known(Cause::station_silent, 2)}), "station-silent 2");
}

TEST_F(Diagnose, OnlyDamageOfEverybodyIsBaudOrParity) {
    EXPECT_EQ(alone(Mix().zeroed(5)), "wrong-parity");
    EXPECT_EQ(causes({{1, Mix().zeroed(9)}, {2, Mix().zeroed(9)}}), "wrong-parity");
    EXPECT_EQ(causes({{1, Mix().strange(9)}, {2, Mix().strange(9)}}), "wrong-parity")
        << "the right pace and wrong bytes: data bits";
    EXPECT_EQ(causes({{1, Mix().garbage(9)}, {2, Mix().garbage(9)}}), "wrong-baud");
    EXPECT_EQ(alone(Mix().garbage(9).lost(20)), "wrong-baud");
    EXPECT_EQ(alone(Mix().garbage(20).answered(2)), "wrong-baud");
    EXPECT_EQ(alone(Mix().garbage(4)), "noise") << "too few to tell";
    EXPECT_EQ(causes({{1, Mix().damaged(9)}, {2, Mix().damaged(9)}}), "noise")
        << "right beginnings: neither";
    EXPECT_EQ(causes({{1, Mix().garbage(9)}, {2, Mix().answered(9)}}), "wrong-baud 1");
}

TEST_F(Diagnose, WhereAllOfAsciiIsDamagedTheFormatDiffersAndPerhapsTheMode) {
    facts.serial = {9600, 7, Parity::even, 1, SerialMode::ascii};
    const Finding found = only("wrong-baud", {{1, Mix().garbage(9)}, {2, Mix().strange(9)}});
    EXPECT_THAT(found.text, HasSubstr("not Modbus ASCII"));
    EXPECT_THAT(found.advice, HasSubstr("9600 7E1 ASCII"));
}

TEST_F(Diagnose, WithoutAParityCheckZerosAreNothingSpecial) {
    facts.serial.parity = Parity::none;
    EXPECT_EQ(alone(Mix().long_damaged(9)), "noise");
    EXPECT_EQ(alone(Mix().zeroed(9)), "wrong-parity");
}

TEST_F(Diagnose, TheDriversErrorCountsDecide) {
    uart = line::UartErrors{40, 2, 0, 0};
    EXPECT_EQ(alone(Mix().zeroed(9)), "wrong-baud");
    uart = line::UartErrors{2, 40, 0, 0};
    EXPECT_EQ(alone(Mix().garbage(9)), "wrong-parity");
    EXPECT_EQ(alone(Mix().damaged(9)), "wrong-parity");
    uart = line::UartErrors{40, 2, 0, 60};
    EXPECT_THAT(findings({{1, Mix().garbage(9)}})[0].advice, HasSubstr("swapped"));
    EXPECT_THAT(findings({{1, Mix().garbage(9)}})[0].evidence, HasSubstr("40 framing"));
    uart = line::UartErrors{0, 0, 3, 0};
    EXPECT_EQ(alone(Mix().answered(90).damaged(3)), "overrun");
    EXPECT_EQ(alone(Mix().answered(90)), "overrun");
    EXPECT_EQ(alone(Mix().answered(90).damaged(30)), "overrun, noise");
    uart = line::UartErrors{1, 1, 1, 1};
    EXPECT_EQ(alone(Mix().answered(90)), "");
}

TEST_F(Diagnose, SporadicDamageOfEverybodyIsNoise) {
    EXPECT_EQ(alone(Mix().answered(97).damaged(3)), "noise");
    EXPECT_EQ(causes({{1, Mix().answered(100).damaged(4)}, {2, Mix().answered(100).damaged(5)}}),
              "noise");
    EXPECT_EQ(alone(Mix().answered(10).damaged(10)), "noise");
    EXPECT_EQ(causes({{1, Mix().answered(2)}, {2, Mix().answered(1).damaged(2)}}), "");
    const std::vector<Finding> noise{known(Cause::noise)};
    EXPECT_EQ(alone(Mix().answered(500).damaged(3)), "");
    EXPECT_EQ(causes({{1, Mix().answered(500).damaged(3)}}, noise), "noise");
    EXPECT_EQ(causes({{1, Mix().answered(500).damaged(1)}}, noise), "");
}

TEST_F(Diagnose, AFewDamagedRepliesOfOneOfTwoStationsAreInconclusive) {
    const Symptoms few = Mix().answered(20).damaged(3);
    EXPECT_EQ(causes({{1, Mix().answered(20)}, {2, few}}), "");
    EXPECT_EQ(causes({{1, Mix().answered(20).damaged(1)}, {2, few}}), "noise");
    EXPECT_EQ(causes({{1, Mix().answered(60)}, {2, few}}), "damaged-replies 2");
    EXPECT_EQ(causes({{1, Mix().answered(2)}, {2, Mix().answered(20).damaged(9)}}), "noise")
        << "the other one was hardly asked";
}

TEST_F(Diagnose, DamageOfLongRepliesPointsToTheTermination) {
    const Symptoms mixed = Mix().answered(100).long_answered(50).long_damaged(10);
    EXPECT_THAT(only("noise", {{1, mixed}, {2, Mix().answered(100)}}).advice,
                HasSubstr("termination first"))
        << "nobody else says long ones, so it is not this one";
    EXPECT_THAT(findings({{1, Mix().answered(90).damaged(9)}})[0].advice,
                Not(HasSubstr("termination first")));
}

TEST_F(Diagnose, UnsolicitedBytesPointToTheBias) {
    EXPECT_THAT(only("noise", {{1, Mix().answered(60).with(&Symptoms::strays, 20)}}).advice,
                HasSubstr("bias first"));
    EXPECT_EQ(alone(Mix().answered(60).with(&Symptoms::strays, 2)), "");
}

TEST_F(Diagnose, DamageOrDuplicatesOfOneAddressOnly) {
    const Symptoms damaged = Mix().answered(30).damaged(6);
    EXPECT_EQ(beside(damaged), "damaged-replies 2");
    EXPECT_EQ(beside(Mix().damaged(6)), "damaged-replies 2");
    EXPECT_EQ(beside(Mix().garbage(6)), "wrong-baud 2");
    EXPECT_EQ(beside(Mix().answered(30).damaged(6).with(&Symptoms::damaged_long, 3)),
              "damaged-replies 2")
        << "none came twice: no second panel";
    EXPECT_EQ(beside(Mix().zeroed(6)), "wrong-parity 2");
    EXPECT_EQ(beside(Mix().answered(30).with(&Symptoms::doubled, 3)), "duplicate-address 2");
    EXPECT_EQ(beside(Mix().lost(3).answered(60).with(&Symptoms::doubled, 3)), "")
        << "late now and then: each repetition is the reply to a retry";
    EXPECT_EQ(alone(Mix().answered(30).damaged(3).with(&Symptoms::doubled, 1)),
              "duplicate-address 1");
    EXPECT_EQ(beside(Mix().answered(30).with(&Symptoms::doubled, 1)), "");
    EXPECT_EQ(causes({{1, Mix().answered(50).damaged(6)}, {2, damaged}}), "noise");
}

TEST_F(Diagnose, SilentWhenAskedQuicklyIsAGapTooShort) {
    const Symptoms quick = Mix().answered(50, 0);
    const auto causes_of = [&](const Symptoms& two) { return causes({{1, quick}, {2, two}}); };
    EXPECT_EQ(only("gap-too-short 2", {{1, quick}, {2, Mix().lost(6, 0).answered(6)}}).advice,
              "Set its `timing.frame_gap` to 10ms.");
    EXPECT_THAT(
        findings({{2, Mix().lost(6, 0).lost(3, 3).answered(2, 3).answered(6, 5)}})[0].advice,
        HasSubstr("32ms"));
    EXPECT_EQ(causes_of(Mix().lost(6, 0).answered(6, 0).answered(20)), "gap-too-short 2");
    EXPECT_EQ(causes_of(Mix().lost(6, 0).answered(9, 0).answered(20)), "") << "mostly answered";
    EXPECT_EQ(causes_of(Mix().lost(6, 0).answered(20).lost(6)), "")
        << "silent after long pauses, too";
    EXPECT_EQ(causes_of(Mix().lost(4, 0).answered(20)), "");
    EXPECT_EQ(causes_of(Mix().lost(6).answered(20, 0)), "")
        << "the other way round: it was off for a while";
}

TEST_F(Diagnose, LateRepliesAreATimeoutTooShortAndNoGap) {
    facts.response_timeouts[2] = 100ms;
    const Finding found =
        only("timeout-too-short 2", {{1, fine}, {2, Mix().lost(6, 0).answered(6).late(6, 41ms)}});
    EXPECT_EQ(found.advice, "Set its `timing.response_timeout` to 180ms.");
    EXPECT_THAT(found.evidence, HasSubstr("6 replies came up to 41ms after the timeout of 100ms"));
    EXPECT_EQ(beside(Mix().silent(9).late(3, 50ms)), "timeout-too-short 2");
    EXPECT_EQ(causes({{0, Mix().answered(6).lost(3).late(3, 50ms)}}), "timeout-too-short");
}

TEST_F(Diagnose, ForeignRequestsAreAnotherMaster) {
    const auto heard = [](unsigned n) { return Mix().answered(50).with(&Symptoms::requests, n); };
    EXPECT_THAT(only("other-master", {{1, heard(3)}}).evidence,
                HasSubstr("3 requests of another master"));
    EXPECT_EQ(alone(heard(2)), "");
    EXPECT_EQ(alone(heard(9).damaged(5)), "other-master") << "its frames damage ours";
    EXPECT_EQ(alone(heard(9).with(&Symptoms::doubled, 5)), "other-master")
        << "it reads what we read";
    EXPECT_EQ(alone(heard(3).with(&Symptoms::doubled, 9)), "other-master, duplicate-address 1");
    EXPECT_EQ(causes({{1, Mix().answered(9).late(3, 9s).with(&Symptoms::requests, 3)},
                      {2, Mix().answered(9).with(&Symptoms::wrong, 3)}}),
              "other-master")
        << "what it is answered looks late or wrong";
}

TEST_F(Diagnose, FramesOfStationsThatAreNotOursAreAnotherMasterToo) {
    const Symptoms stranger = Mix().with(&Symptoms::unasked, 3);
    EXPECT_EQ(causes({{0, stranger}, {1, fine}}), "other-master");
    EXPECT_EQ(beside(stranger), "") << "it is ours";
    EXPECT_EQ(causes({{0, Mix().with(&Symptoms::unasked, 2)}, {1, fine}}), "");
    EXPECT_EQ(causes({{0, Mix().silent(9).with(&Symptoms::unasked, 3)}, {1, fine}}), "")
        << "those were asked, too";
    broadcasts = 3;
    EXPECT_EQ(causes({{0, stranger}, {1, fine}}), "") << "it may answer the broadcasts";
}

TEST_F(Diagnose, AnEchoThatTheConfigurationDeniesOrInvents) {
    const auto echoed = [](unsigned n) { return Mix().answered(50).with(&Symptoms::echoes, n); };
    EXPECT_EQ(alone(echoed(3)), "");
    facts.echo = EchoMode::off;
    EXPECT_EQ(alone(echoed(3)), "echo");
    EXPECT_EQ(alone(echoed(2)), "");
    facts.echo = EchoMode::on;
    EXPECT_EQ(alone(echoed(3)), "");
    EXPECT_EQ(alone(Mix().with(&Symptoms::collided, 6)), "echo");
    EXPECT_EQ(alone(echoed(50).with(&Symptoms::collided, 6)), "collision");
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

TEST_F(Diagnose, ADeviceOnEthernetHasNoWires) {
    facts.serial.baud = SerialFormat::kNoWire;
    const auto all = findings({{1, Mix().silent(9)}, {2, Mix().silent(9)}});
    ASSERT_EQ(all.size(), 1U);
    EXPECT_NE(all[0].advice.find("unit ids"), std::string::npos);
    EXPECT_EQ(all[0].advice.find("wires"), std::string::npos);
}

/// A plain fault on a line that is otherwise healthy: the right finding, or none.
struct Fault {
    const char* what;
    Stations stations;
    std::string serial;    ///< findings on a line of its own
    std::string over_tcp;  ///< ... and behind a device server; "=": the same
};

const Symptoms kBusy = Mix().answered(400, 0).answered(200);
const Symptoms kOff = Mix().answered(50).silent(9);
const Symptoms kWasOff = Mix().answered(20, 0).silent(9).answered(50);
const Symptoms kBack = Mix().answered(90).silent(9).answered(9);
const Symptoms kHit = Mix().answered(192).damaged(8);  // 4 %
const Symptoms kLate = Mix().silent(20).late(20, 300ms);
const Symptoms kSomeLate = Mix().silent(20).late(6, 700ms);
const Symptoms kOftenLate = Mix().answered(4).silent(30).late(4, 700ms);
const Symptoms kHitOften = Mix().answered(150).damaged(5).with(&Symptoms::strays, 12);
const Symptoms kLost1 = Mix().answered(297).lost(3);
const Symptoms kLost1Quick = Mix().answered(297, 0).lost(2, 0).lost(1);
const Symptoms kLost10 = Mix().answered(270).lost(30);
const Symptoms kLost10Quick = Mix().answered(270, 0).lost(25, 0).lost(5);
const Symptoms kDamaged4 = Mix().answered(396).damaged(4);
const Symptoms kDamaged5 = Mix().answered(396).damaged(5);
const Symptoms kBusyHit = Mix().answered(300).damaged(5);
const Symptoms kBaud = Mix().garbage(20);
const Symptoms kParity = Mix().zeroed(20);

const std::vector<Fault> kPlainFaults{
    {"nothing", {{1, kBusy}, {2, kBusy}}, "", "="},
    {"a panel is off", {{1, kBusy}, {2, kOff}}, "station-silent 2", "="},
    {"a panel was off and is back", {{1, kBusy}, {2, kWasOff}}, "", "="},
    {"a plug was out and is in", {{1, kBack}, {2, kBack}}, "", "="},
    {"a register is ignored", {{1, kBusy}, {2, Mix().silent(40).answered(90, 0)}}, "", "="},
    {"one panel's replies are damaged", {{1, kBusy}, {2, kHit}}, "damaged-replies 2", "="},
    {"one panel's baud", {{1, kBusy}, {2, kBaud}}, "wrong-baud 2", "damaged-replies 2"},
    {"one panel's parity", {{1, kBusy}, {2, kParity}}, "wrong-parity 2", "damaged-replies 2"},
    {"all have another baud", {{1, kBaud}, {2, kBaud}}, "wrong-baud", "tcp-framing"},
    {"all have another parity", {{1, kParity}, {2, kParity}}, "wrong-parity", "="},
    {"a panel is late", {{1, kBusy}, {2, kLate}}, "timeout-too-short 2", "="},
    {"... into a neighbour", {{1, kBusy}, {2, kSomeLate}, {4, kHit}}, "timeout-too-short 2", "="},
    {"... into all", {{1, kBusyHit}, {2, kOftenLate}, {4, kHitOften}}, "timeout-too-short 2", "="},
    {"strangers are looked for", {{0, Mix().silent(200)}, {1, kBusy}, {2, kBusy}}, "", "="},
    {"1 % is lost", {{1, kLost1Quick}, {2, kLost1}}, "", "="},
    {"10 % is lost", {{1, kLost10Quick}, {2, kLost10}}, "", "="},
    {"1 % is damaged", {{1, kDamaged4}, {2, kDamaged5}}, "noise", "="},
};

/// Texts and figures report the same numbers.
TEST_F(Diagnose, EachPlainFaultAloneIsNamedRightlyOrNotAtAll) {
    for (const Fault& fault : kPlainFaults) {
        for (const bool over_tcp : {false, true}) {
            SCOPED_TRACE(fault.what + std::string(over_tcp ? ", tcp" : ""));
            facts.over_tcp = over_tcp;
            const std::vector<Finding> found = findings(fault.stations);
            EXPECT_EQ(text_of(found),
                      over_tcp && fault.over_tcp != "=" ? fault.over_tcp : fault.serial);
            for (const Finding& f : found) {
                EXPECT_FALSE(f.figures.empty()) << code(f.cause);
                for (const auto& [name, value] : f.figures)
                    EXPECT_THAT(f.evidence + f.advice, HasSubstr(std::to_string(value))) << name;
            }
        }
    }
}

}  // namespace
}  // namespace panelgate::doctor::diagnose_test
