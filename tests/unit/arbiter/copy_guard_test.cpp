#include "panelgate/arbiter/outstanding.hpp"

#include <gtest/gtest.h>

#include "support/hex.hpp"

namespace panelgate::arbiter::copy_guard_test {
namespace {

const Bytes kRequest = "03 00 6B 00 01"_hex;
const Bytes kOtherRequest = "03 00 6C 00 01"_hex;
const Bytes kReply = "03 02 00 01"_hex;
const Bytes kOtherReply = "03 02 00 02"_hex;
const Bytes kOfOtherShape = "03 04 00 01 00 02"_hex;

class DuplicateGuardTest : public testing::Test {
  protected:
    void reply(const Bytes& pdu = kReply) {
        now_ += 1s;
        guard_.on_reply(now_, kRequest, pdu);
    }
    void unasked(Duration behind, const Bytes& pdu) { guard_.on_unasked(now_ + behind, pdu); }

    DuplicateGuard guard_;
    TimePoint now_{1h};
};

TEST_F(DuplicateGuardTest, P1AnExactRepetitionOfARecentReplyIsADuplicate) {
    EXPECT_FALSE(guard_.is_duplicate(now_, kReply));
    reply();
    guard_.on_reply(now_ + 50ms, kOtherRequest, kOtherReply);
    EXPECT_TRUE(guard_.is_duplicate(now_ + 60ms, kReply)) << "also of the one before";
    EXPECT_TRUE(guard_.is_duplicate(now_ + 60ms, kOtherReply));
    EXPECT_FALSE(guard_.is_duplicate(now_ + 60ms, "03 02 00 03"_hex));
    EXPECT_FALSE(guard_.is_duplicate(now_ + DuplicateGuard::kLongest + 1ns, kReply));
}

TEST_F(DuplicateGuardTest, P1OneDuplicateShowsThatTheStationSendsTwiceAndHowLongItMustRest) {
    reply();
    unasked(20ms, kReply);
    EXPECT_TRUE(guard_.known());
    EXPECT_GT(guard_.settle_time(), Duration(20ms));
    EXPECT_LT(guard_.settle_time(), Duration(60ms));
    reply();
    unasked(80ms, kReply);
    EXPECT_GT(guard_.settle_time(), Duration(80ms)) << "as long as the longest";
    reply();
    unasked(5ms, kReply);
    EXPECT_GT(guard_.settle_time(), Duration(80ms));
}

TEST_F(DuplicateGuardTest, P1WhatOnlyHasTheShapeOfTheReplyHasToComeTwice) {
    reply();
    EXPECT_TRUE(guard_.is_second(now_ + 20ms, kOtherReply));
    unasked(20ms, kOtherReply);
    EXPECT_FALSE(guard_.known());
    reply();
    unasked(30ms, kOtherReply);
    EXPECT_TRUE(guard_.known());
    EXPECT_GT(guard_.settle_time(), Duration(30ms));
}

TEST_F(DuplicateGuardTest, WhatHasAnotherShapeOrComesLongAfterTeachesNothing) {
    for (int i = 0; i < 5; ++i) {
        reply();
        EXPECT_FALSE(guard_.is_second(now_ + 20ms, kOfOtherShape));
        unasked(20ms, kOfOtherShape);
        unasked(DuplicateGuard::kLongest + 1ns, kReply);
    }
    EXPECT_FALSE(guard_.known());
    EXPECT_EQ(guard_.settle_time(), Duration(0));
}

TEST_F(DuplicateGuardTest, IsForgottenSomeMinutesAfterItStopped) {
    reply();
    unasked(20ms, kReply);
    const TimePoint last = now_;
    while (now_ < last + DuplicateGuard::kForget - 1s) reply();
    EXPECT_TRUE(guard_.known());
    for (int i = 0; i < 3; ++i) reply();
    EXPECT_FALSE(guard_.known());
}

TEST_F(DuplicateGuardTest, P1AnEqualAnswerToAnotherRequestIsSuspiciousForAMoment) {
    reply();
    EXPECT_TRUE(guard_.suspicious(now_ + 20ms, kOtherRequest, kReply));
    EXPECT_FALSE(guard_.suspicious(now_ + 20ms, kRequest, kReply));
    EXPECT_FALSE(guard_.suspicious(now_ + 20ms, kOtherRequest, kOtherReply));
    EXPECT_FALSE(guard_.suspicious(now_ + DuplicateGuard::kLongest + 1ns, kOtherRequest, kReply));
}

TEST_F(DuplicateGuardTest, P1AStationThatWasSeenToGiveEqualAnswersIsBelievedUntilItSpeaksTwice) {
    reply();
    for (int i = 0; i < DuplicateGuard::kConfirmations; ++i) {
        EXPECT_TRUE(guard_.suspicious(now_ + 20ms, kOtherRequest, kReply));
        guard_.on_confirmed(kOtherRequest, kReply);
    }
    EXPECT_FALSE(guard_.suspicious(now_ + 20ms, kOtherRequest, kReply));
    unasked(20ms, kReply);
    EXPECT_TRUE(guard_.suspicious(now_ + 30ms, kOtherRequest, kReply));
}

TEST_F(DuplicateGuardTest, P1AStationWithEqualAnswersToWritesIsNotTrustedWhenItIsRead) {
    reply();
    for (int i = 0; i < DuplicateGuard::kConfirmations; ++i)
        guard_.on_confirmed("10 00 10 00 01 02 00 01"_hex, "10 00 10 00 01"_hex);
    EXPECT_TRUE(guard_.suspicious(now_ + 20ms, kOtherRequest, kReply));
}

TEST_F(DuplicateGuardTest, P1AStationThatRepeatsItsExceptionsIsNotTrustedWhenItRepeatsValues) {
    reply();
    for (int i = 0; i < DuplicateGuard::kConfirmations; ++i)
        guard_.on_confirmed(kOtherRequest, "83 06"_hex);
    EXPECT_TRUE(guard_.suspicious(now_ + 20ms, kOtherRequest, kReply));
}

/// The value may just have changed: only several in a row, within minutes, show a duplicate.
TEST_F(DuplicateGuardTest, P1AReplyDeniedThreeTimesWhenAskedOnceMoreWasADuplicate) {
    const auto deny = [&] {
        now_ += 1s;
        reply();
        guard_.on_denied(now_ + 20ms, kReply);
    };
    deny();
    deny();
    guard_.on_confirmed(kOtherRequest, kReply);
    deny();
    EXPECT_FALSE(guard_.known()) << "not in a row";
    now_ += DuplicateGuard::kForget + 1s;
    deny();
    deny();
    EXPECT_FALSE(guard_.known()) << "the first was long ago";
    deny();
    EXPECT_EQ(guard_.settle_time(), Duration(30ms));
}

TEST_F(DuplicateGuardTest, P1AStationThatIsDeniedIsNoLongerTrusted) {
    reply();
    for (int i = 0; i < DuplicateGuard::kConfirmations; ++i)
        guard_.on_confirmed(kOtherRequest, kReply);
    EXPECT_FALSE(guard_.suspicious(now_ + 20ms, kOtherRequest, kReply));
    guard_.on_denied(now_ + 20ms, kReply);
    EXPECT_TRUE(guard_.suspicious(now_ + 20ms, kOtherRequest, kReply));
}

TEST_F(DuplicateGuardTest, P1AfterADenialAnEqualAnswerToTheVerySameRequestIsSuspiciousToo) {
    reply();
    EXPECT_FALSE(guard_.suspicious(now_ + 20ms, kRequest, kReply));
    guard_.on_denied(now_ + 20ms, kReply);
    EXPECT_TRUE(guard_.suspicious(now_ + 40ms, kRequest, kReply));
    guard_.on_confirmed(kRequest, kReply);
    EXPECT_FALSE(guard_.suspicious(now_ + 60ms, kRequest, kReply)) << "it has not changed";
    guard_.on_denied(now_ + 80ms, kReply);
    now_ += DuplicateGuard::kForget + 1s;
    reply();
    EXPECT_FALSE(guard_.suspicious(now_ + 20ms, kRequest, kReply)) << "long ago";
}

TEST_F(DuplicateGuardTest, P1AStationThatAnswersOneRequestTwiceSendsDuplicates) {
    guard_.on_repeated_reply(now_ + 30ms, now_ + 10ms, kReply);
    EXPECT_EQ(guard_.settle_time(), Duration(30ms));
    reply();
    guard_.on_repeated_reply(now_ + 60ms, now_ + 50ms, kReply);
    EXPECT_EQ(guard_.settle_time(), Duration(75ms))
        << "the first may have been a copy of the one before";
    guard_.on_repeated_reply(now_ + 60ms + DuplicateGuard::kLongest, now_ + 50ms, kReply);
    EXPECT_EQ(guard_.settle_time(), Duration(75ms)) << "later, it is something else";
}

TEST_F(DuplicateGuardTest, P1WhatIsInDoubtIsWaitedForBehindOneMoreReply) {
    reply();
    guard_.on_doubt(20ms);
    EXPECT_FALSE(guard_.known());
    EXPECT_GE(guard_.take_doubt(), Duration(20ms));
    EXPECT_EQ(guard_.take_doubt(), Duration(0));
}

TEST_F(DuplicateGuardTest, P1AStationRepeatsItselfAsSoonAsItsDuplicatesComeAndNotMuchLater) {
    reply();
    EXPECT_FALSE(guard_.repeats_itself(now_ + 1ms, kReply)) << "not known";
    unasked(20ms, kReply);
    EXPECT_TRUE(guard_.repeats_itself(now_ + 40ms, kReply));
    EXPECT_FALSE(guard_.repeats_itself(now_ + 40ms, kOtherReply));
    EXPECT_FALSE(guard_.repeats_itself(now_ + 100ms, kReply));
}

TEST_F(DuplicateGuardTest, P1FindsADuplicateAmidOtherBytes) {
    reply();
    Bytes amid = "00 FF"_hex;
    const Bytes adu = modbus::encode_adu(0x11, kReply);
    amid.insert(amid.end(), adu.begin(), adu.end());
    EXPECT_NE(guard_.duplicate_in(now_ + 20ms, 0x11, amid), nullptr);
    EXPECT_EQ(guard_.duplicate_in(now_ + 20ms, 0x12, amid), nullptr);
    EXPECT_EQ(guard_.duplicate_in(now_ + DuplicateGuard::kLongest + 1ns, 0x11, amid), nullptr);
    amid.back() ^= 1;
    EXPECT_EQ(guard_.duplicate_in(now_ + 20ms, 0x11, amid), nullptr)
        << "a damaged reply of equal values";
}

TEST_F(DuplicateGuardTest, ADuplicateIsOfTheLatestReplyThatItRepeats) {
    reply();
    guard_.on_reply(now_ + 200ms, kOtherRequest, kReply);
    unasked(220ms, kReply);
    EXPECT_TRUE(guard_.known());
    EXPECT_LT(guard_.settle_time(), Duration(60ms));
}

}  // namespace
}  // namespace panelgate::arbiter::copy_guard_test
