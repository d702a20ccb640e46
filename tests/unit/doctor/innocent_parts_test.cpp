// Habits of panels, adapters and networks that look like another fault: the part that is named is
// the one that has it, or none is named. The figures are those that such lines were measured with.
#include <gmock/gmock.h>

#include <cstdint>

#include "case.hpp"
#include "panelgate/doctor/doctor.hpp"

namespace panelgate::doctor::innocent_parts_test {
namespace {

using arbiter::Symptoms;
using ::testing::HasSubstr;
using ::testing::Not;

const Symptoms kHealthy = Mix().answered(600);

class Innocent : public Diagnose {
  protected:
    /// Findings beside a healthy station 6.
    std::string beside_6(const Symptoms& five) const {
        return causes({{0, {}}, {5, five}, {6, kHealthy}});
    }
    Finding finding_of_5(const Symptoms& five) const {
        const auto found = findings({{0, {}}, {5, five}, {6, kHealthy}});
        EXPECT_EQ(found.size(), 1u) << text_of(found);
        return found.empty() ? Finding{} : found.front();
    }
};

TEST_F(Innocent, WithoutARepeatedReplyThereIsNoSecondPanel) {
    const Symptoms longer = Mix()
                                .answered(830)
                                .garbage(12)
                                .with(&Symptoms::damaged_long, 26)
                                .with(&Symptoms::damaged_heads, 38);
    EXPECT_EQ(beside_6(longer), "damaged-replies 5");
    EXPECT_THAT(finding_of_5(longer).advice, HasSubstr("a second panel has it"));
    EXPECT_THAT(finding_of_5(Mix().answered(300).damaged(20)).advice, Not(HasSubstr("second")));
    for (const bool over_tcp : {false, true}) {
        facts.over_tcp = over_tcp;
        const Symptoms tenth = Mix().answered(270).damaged(15).with(&Symptoms::damaged_long, 15);
        const auto found = findings({{5, tenth}, {6, tenth}});
        EXPECT_FALSE(found.empty());
        for (const Finding& f : found)
            EXPECT_NE(f.cause, Cause::duplicate_address) << "both have the same damage";
    }
}

TEST_F(Innocent, FramesInTheFormOfTheLastReplyAreNoSecondPanelWhereTheyHaveAnotherCause) {
    const Symptoms misfits =
        Mix().answered(170).with(&Symptoms::wrong, 25).with(&Symptoms::doubled, 6);
    EXPECT_EQ(beside_6(misfits), "wrong-reply 5") << "04 is answered with 03";
    EXPECT_EQ(beside_6(Mix().answered(170).with(&Symptoms::wrong, 25).with(&Symptoms::doubled, 90)),
              "wrong-reply 5, duplicate-address 5");
    broadcasts = 25;
    const Symptoms to_all =
        Mix().answered(300).with(&Symptoms::broadcast_replies, 12).with(&Symptoms::doubled, 21);
    EXPECT_EQ(beside_6(to_all), "answers-broadcasts 5");
    const Symptoms later =
        Mix().answered(150).with(&Symptoms::broadcast_replies, 12).with(&Symptoms::unasked, 12);
    EXPECT_EQ(beside_6(later), "answers-broadcasts 5") << "some of its answers come late";
}

TEST_F(Innocent, APanelThatAnswersUnderItsNeighboursAddressIsNeitherOffNorIsTheNeighbourTwo) {
    const Symptoms five = Mix()
                              .answered(40)
                              .with(&Symptoms::disturbed, 30)
                              .silent(30)
                              .with(&Symptoms::misaddressed, 30);
    const Symptoms six =
        Mix().answered(600).with(&Symptoms::doubled, 45).with(&Symptoms::unasked, 15);
    EXPECT_EQ(causes({{5, five}, {6, six}}), "wrong-reply 5");
    EXPECT_THAT(findings({{5, five}, {6, six}})[0].text, HasSubstr("address of another station"));
    EXPECT_EQ(causes({{5, kHealthy}, {6, six}}), "duplicate-address 6");
}

TEST_F(Innocent, GoodFramesAreNoNoise) {
    const Symptoms babble =
        Mix().answered(70).with(&Symptoms::unasked, 120).with(&Symptoms::strays, 10);
    const Symptoms met = Mix().answered(250).with(&Symptoms::strays, 50);
    EXPECT_EQ(causes({{5, met}, {6, babble}}), "unasked-frames 6") << "they have met other frames";
}

TEST_F(Innocent, BytesAroundTheRepliesOfOnePanelAreNotTheLines) {
    const Symptoms fives = Mix().answered(300).with(&Symptoms::strays, 60);
    EXPECT_EQ(beside_6(fives), "");
    const Finding both = only("noise", {{5, fives}, {6, fives}});
    EXPECT_EQ(both.evidence, "120 times bytes around or between frames") << "no reply is damaged";
    EXPECT_THAT(both.text, Not(HasSubstr("damaged")));
}

TEST_F(Innocent, FramesOfOurStationsShowNoOtherMaster) {
    const Symptoms babble = Mix().answered(200).with(&Symptoms::unasked, 30);
    EXPECT_EQ(beside_6(babble), "unasked-frames 5");
    const Symptoms never_asked = Mix().with(&Symptoms::unasked, 30);
    EXPECT_EQ(beside_6(never_asked), "unasked-frames 5");
    EXPECT_THAT(finding_of_5(never_asked).advice, HasSubstr("another master asks it"));
    EXPECT_EQ(causes({{0, never_asked}, {5, kHealthy}}), "other-master") << "not ours";
}

TEST_F(Innocent, WhatComesUnaskedMayHaveTheFormOfTheLastReply) {
    const Symptoms babble =
        Mix().answered(700).with(&Symptoms::unasked, 90).with(&Symptoms::doubled, 40);
    EXPECT_EQ(beside_6(babble), "unasked-frames 5");
    const Symptoms twins =
        Mix().answered(700).with(&Symptoms::unasked, 40).with(&Symptoms::doubled, 400);
    EXPECT_EQ(beside_6(twins), "duplicate-address 5");
}

TEST_F(Innocent, TwoAnswersThatDifferAndOthersRunIntoEachOtherAreTwoPanels) {
    const Symptoms two = Mix()
                             .answered(20)
                             .with(&Symptoms::damaged_long, 20)
                             .with(&Symptoms::damaged_heads, 20)
                             .with(&Symptoms::unasked, 40);
    EXPECT_EQ(beside_6(two), "duplicate-address 5");
    EXPECT_THAT(finding_of_5(two).evidence, HasSubstr("40 frames came beside the replies"));
}

TEST_F(Innocent, RequestsThatComeBackAtOneOfSeveralStationsAreThatPanels) {
    const Symptoms five =
        Mix().answered(170).with(&Symptoms::collided, 30).with(&Symptoms::echoes, 20);
    EXPECT_EQ(beside_6(five), "repeats-requests 5");
    const Symptoms six = Mix().answered(300).with(&Symptoms::collided, 90);
    EXPECT_EQ(causes({{5, five}, {6, six}}), "repeats-requests 5") << "its echo was waited for";
    facts.echo = EchoMode::off;
    EXPECT_EQ(beside_6(five), "repeats-requests 5") << "and no adapter's echo";
    facts.echo = EchoMode::automatic;
    EXPECT_EQ(causes({{5, five}, {6, five}}), "collision") << "of all: the line's";
    EXPECT_EQ(causes({{5, five}}), "collision") << "nobody else says anything";
}

TEST_F(Innocent, APanelThatAnswersEachSecondRequestIsNamed) {
    const Symptoms each_second = Mix()
                                     .answered(270)
                                     .silent(270)
                                     .answered(1)
                                     .with(&Symptoms::silences, 250)
                                     .with(&Symptoms::repeated, 90);
    EXPECT_EQ(beside_6(each_second), "misses-requests 5");
    facts.over_tcp = true;
    EXPECT_EQ(beside_6(each_second), "misses-requests 5");
    const Symptoms lacks_it =
        Mix().answered(90).silent(40).answered(1).with(&Symptoms::silences, 40);
    EXPECT_EQ(beside_6(lacks_it), "") << "always the same requests: it has not got that";
    const Symptoms was_off = Mix()
                                 .answered(50)
                                 .silent(90)
                                 .answered(50)
                                 .with(&Symptoms::silences, 2)
                                 .with(&Symptoms::repeated, 9);
    EXPECT_EQ(beside_6(was_off), "");
    const Symptoms late = Mix()
                              .answered(100)
                              .silent(90)
                              .answered(1)
                              .with(&Symptoms::silences, 90)
                              .with(&Symptoms::repeated, 60)
                              .late(80, 100ms);
    EXPECT_EQ(beside_6(late), "timeout-too-short 5");
}

TEST_F(Innocent, RepliesWithoutTheirFirstBytesAreTheAdaptersOrTheServers) {
    const auto lost = [](std::uint64_t n) {
        return Mix().answered(200).with(&Symptoms::damaged_short, n).with(&Symptoms::beheaded, n);
    };
    const Finding noise = only("noise", {{5, lost(90)}, {6, lost(80)}});
    EXPECT_THAT(noise.advice, HasSubstr("lose their first bytes"));
    EXPECT_THAT(noise.evidence, HasSubstr("170 are right but for their first bytes"));
    facts.over_tcp = true;
    EXPECT_THAT(only("tcp-framing", {{5, lost(90)}, {6, lost(80)}}).advice,
                HasSubstr("lose their first bytes"));
    EXPECT_EQ(beside_6(lost(90)), "damaged-replies 5");
}

TEST_F(Innocent, SomeRepliesWithTheirCrcSwappedAreDamageOfThatPanel) {
    const Symptoms some = Mix().answered(80).damaged(33).with(&Symptoms::crc_swapped, 33);
    EXPECT_EQ(beside_6(some), "damaged-replies 5");
    EXPECT_THAT(finding_of_5(some).evidence, HasSubstr("33 but for the order of the CRC's bytes"));
}

}  // namespace
}  // namespace panelgate::doctor::innocent_parts_test
