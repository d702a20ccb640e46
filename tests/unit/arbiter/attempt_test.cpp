#include "panelgate/arbiter/attempt.hpp"

#include <gtest/gtest.h>

#include <utility>

#include "panelgate/modbus/rtu_frame.hpp"
#include "support/attempts.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::attempt_test {
namespace {

using modbus::encode_adu;
using test::group_of;

constexpr std::uint8_t kStation = 17;
const Bytes kRead = "03 00 6B 00 03"_hex;
const Bytes kReply = "03 06 02 2B 00 00 00 64"_hex;
const Bytes kOtherReply = "03 06 02 2B 00 00 00 65"_hex;
const Bytes kOfOtherShape = "03 04 00 01 00 02"_hex;

Attempt::Timing timing_of(Duration patience, Duration usual) {
    Attempt::Timing timing = Attempt::timing_of(Settings{}, TimePoint{1h}, 8, Duration::zero());
    timing.patience = patience;
    timing.usual = usual;
    return timing;
}

class AttemptTest : public testing::Test {
  protected:
    /// This long after the request had left.
    Verdict hear(Duration after, const Bytes& bytes) {
        return attempt_.on_rx(attempt_.timing().sent + after, bytes, ends_);
    }
    /// Calls on_deadline until there is a verdict; its time is in ended_.
    Verdict run_to_verdict() {
        for (int i = 0; i < 100; ++i) {
            const TimePoint due = attempt_.deadline();
            const Verdict verdict = attempt_.on_deadline(due, ends_);
            ended_ = due - attempt_.timing().sent;
            if (verdict != Verdict::open) return verdict;
        }
        ADD_FAILURE() << "it never ends";
        return Verdict::open;
    }

    Attempt attempt_{group_of(kStation, kRead), timing_of(500ms, 100ms), {}};
    bool other_frame_ends_ = true;
    Attempt::Ends ends_ = [this](ByteView) { return other_frame_ends_; };
    Duration ended_{};
};

TEST_F(AttemptTest, IsSilentWhenItsPatienceIsOverAndNotBefore) {
    EXPECT_EQ(attempt_.on_deadline(attempt_.give_up() - 1ns, ends_), Verdict::open);
    EXPECT_EQ(run_to_verdict(), Verdict::silent);
    EXPECT_EQ(ended_, Duration(500ms));
    EXPECT_FALSE(attempt_.heard());
}

TEST_F(AttemptTest, AReplyMayComeBehindNoiseAndBehindAnotherStationsFrame) {
    EXPECT_EQ(hear(5ms, "FF 00 FF"_hex), Verdict::open);
    EXPECT_EQ(hear(20ms, encode_adu(kStation + 1, kReply)), Verdict::open);
    EXPECT_EQ(hear(40ms, encode_adu(kStation, kReply)), Verdict::replied);
    EXPECT_EQ(attempt_.reply(), kReply);
    EXPECT_FALSE(attempt_.take_unsolicited().empty());
}

TEST_F(AttemptTest, AHoleInAReplyIsWaitedForAndALongerOneMakesItDamage) {
    const Bytes adu = encode_adu(kStation, kReply);
    const Bytes front(adu.begin(), adu.begin() + 5);
    const Bytes rest(adu.begin() + 5, adu.end());
    const Duration hole = attempt_.timing().hole;
    EXPECT_EQ(hear(10ms, front), Verdict::open);
    Attempt late = attempt_;
    EXPECT_EQ(attempt_.on_deadline(attempt_.last_byte() + hole - 1ns, ends_), Verdict::open);
    EXPECT_EQ(hear(10ms + hole - 1ns, rest), Verdict::replied);
    EXPECT_EQ(late.on_deadline(late.last_byte() + hole, ends_), Verdict::open);
    EXPECT_EQ(late.on_rx(late.last_byte() + hole + 1ms, rest, ends_), Verdict::open);
    std::swap(attempt_, late);
    EXPECT_EQ(run_to_verdict(), Verdict::damaged);
}

TEST_F(AttemptTest, DamageDoesNotEndItBeforeTheStationsUsualTime) {
    EXPECT_EQ(hear(5ms, "11 03 06 02"_hex), Verdict::open);
    Attempt other = attempt_;
    EXPECT_EQ(run_to_verdict(), Verdict::damaged);
    EXPECT_GE(ended_, attempt_.timing().usual);
    EXPECT_LT(ended_, attempt_.timing().patience);
    EXPECT_FALSE(attempt_.damaged_bytes().empty());
    std::swap(attempt_, other);
    EXPECT_EQ(attempt_.on_deadline(attempt_.deadline(), ends_), Verdict::open);
    EXPECT_EQ(hear(90ms, encode_adu(kStation, kReply)), Verdict::replied);
}

TEST_F(AttemptTest, AGoodFrameOfTheStationThatDoesNotAnswerEndsItUnlessUnsolicited) {
    Attempt other = attempt_;
    EXPECT_EQ(hear(10ms, encode_adu(kStation, kOfOtherShape)), Verdict::wrong);
    std::swap(attempt_, other);
    other_frame_ends_ = false;
    EXPECT_EQ(hear(10ms, encode_adu(kStation, kOfOtherShape)), Verdict::open);
    EXPECT_EQ(hear(50ms, encode_adu(kStation, kReply)), Verdict::replied);
}

TEST_F(AttemptTest, P1ARejectedReplyCountsAsHeardAndTheNextOneAnswers) {
    ASSERT_EQ(hear(10ms, encode_adu(kStation, kReply)), Verdict::replied);
    attempt_.reject_reply();
    const auto unsolicited = attempt_.take_unsolicited();
    ASSERT_EQ(unsolicited.size(), 1u);
    EXPECT_EQ(unsolicited[0].bytes, encode_adu(kStation, kReply));
    EXPECT_EQ(hear(50ms, encode_adu(kStation, kOtherReply)), Verdict::replied);
    EXPECT_EQ(attempt_.reply(), kOtherReply);
}

TEST_F(AttemptTest, P1ACandidateAnswersWhenNothingElseCameInTheTimeThatTheStationNeeds) {
    ASSERT_EQ(hear(10ms, encode_adu(kStation, kReply)), Verdict::replied);
    attempt_.keep_candidate(60ms, false);
    Attempt other = attempt_;
    EXPECT_EQ(hear(15ms, "FF FF"_hex), Verdict::open);
    EXPECT_EQ(attempt_.on_deadline(attempt_.timing().sent + 60ms - 1ns, ends_), Verdict::open);
    EXPECT_EQ(run_to_verdict(), Verdict::replied);
    EXPECT_EQ(ended_, Duration(60ms));
    EXPECT_EQ(attempt_.reply(), kReply);
    std::swap(attempt_, other);
    EXPECT_EQ(hear(50ms, encode_adu(kStation, kOtherReply)), Verdict::replied);
    EXPECT_EQ(attempt_.reply(), kOtherReply);
    const auto unsolicited = attempt_.take_unsolicited();
    ASSERT_EQ(unsolicited.size(), 1u);
    EXPECT_EQ(unsolicited[0].bytes, encode_adu(kStation, kReply));
}

TEST_F(AttemptTest, P1WhereDuplicatesAreKnownTheCandidateIsNoAnswer) {
    ASSERT_EQ(hear(10ms, encode_adu(kStation, kReply)), Verdict::replied);
    attempt_.keep_candidate(60ms, true);
    EXPECT_EQ(run_to_verdict(), Verdict::doubtful) << "and it is asked once more";
    EXPECT_EQ(ended_, Duration(70ms)) << "a copy may have kept it from saying its own";
    EXPECT_TRUE(attempt_.take_unsolicited().empty()) << "it proves no copy either";
}

TEST_F(AttemptTest, P1ACandidateThatComesOnceMoreIsTheAnswerAndShowsNoDuplicate) {
    ASSERT_EQ(hear(10ms, encode_adu(kStation, kReply)), Verdict::replied);
    attempt_.keep_candidate(60ms, true);
    EXPECT_EQ(hear(30ms, encode_adu(kStation, kReply)), Verdict::replied);
    EXPECT_EQ(attempt_.reply(), kReply);
    EXPECT_TRUE(attempt_.take_unsolicited().empty());
}

TEST_F(AttemptTest, P6NoReadJoinsARepeatedOne) {
    Attempt::Timing timing = attempt_.timing();
    timing.tolerance = 1ms;  // of a real UART
    const Attempt first(group_of(kStation, kRead), timing, {});
    const Attempt retry(group_of(kStation, kRead, 2), timing, {});
    const Job job = group_of(kStation, "03 00 6C 00 01"_hex).jobs[0];
    const Duration whole = timing.sent - timing.started;
    const TimePoint leaving = timing.sent - whole / 40;
    EXPECT_TRUE(first.can_join(leaving, job));
    EXPECT_FALSE(first.can_join(timing.sent - whole / 100, job)) << "the rate may be off";
    EXPECT_FALSE(attempt_.can_join(leaving, job)) << "the far end may have it already";
    EXPECT_FALSE(retry.can_join(leaving, job));
}

}  // namespace
}  // namespace panelgate::arbiter::attempt_test
