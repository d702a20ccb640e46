#include "panelgate/arbiter/attempt/attempt.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

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
const Bytes kReplyAdu = encode_adu(kStation, kReply);
const Bytes kOtherReply = "03 06 02 2B 00 00 00 65"_hex;
const Bytes kOfOtherShape = "03 04 00 01 00 02"_hex;

Attempt::Timing timing_of(Duration usual, const Attempt::Wire& line = test::default_wire()) {
    Attempt::Timing timing = Attempt::timing_of(line, TimePoint{1h}, 8, Duration::zero());
    timing.patience = 500ms;
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
    /// What came beside the reply was this frame alone.
    void expect_unsolicited(const Bytes& adu) {
        const auto unsolicited = attempt_.take_unsolicited();
        ASSERT_EQ(unsolicited.size(), 1u);
        EXPECT_EQ(unsolicited[0].bytes, adu);
    }

    Attempt attempt_{group_of(kStation, kRead), timing_of(100ms), {}};
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

TEST_F(AttemptTest, AHoleInAReplyIsWaitedForAndALongerOneMakesItDamage) {
    const Bytes front(kReplyAdu.begin(), kReplyAdu.begin() + 5);
    const Bytes rest(kReplyAdu.begin() + 5, kReplyAdu.end());
    const Duration hole = attempt_.timing().hole;
    EXPECT_EQ(hear(10ms, front), Verdict::open);
    Attempt late = attempt_;
    EXPECT_EQ(attempt_.on_deadline(attempt_.last_byte() + hole - 1ns, ends_), Verdict::open);
    EXPECT_EQ(hear(10ms + hole - 1ns, rest), Verdict::replied);
    std::swap(attempt_, late);
    EXPECT_EQ(attempt_.on_deadline(attempt_.last_byte() + hole, ends_), Verdict::open);
    EXPECT_EQ(hear(10ms + hole + 1ms, rest), Verdict::open);
    EXPECT_EQ(run_to_verdict(), Verdict::damaged);
}

/// A line that nobody drives: what stands in it may be a part of another's frame, until that has
/// had the time to come.
TEST_F(AttemptTest, AReplyInAHumHasComeWhenItsBytesHaveNotWhenItIsBelieved) {
    EXPECT_EQ(hear(29ms, "12 03 40 00"_hex), Verdict::open);
    EXPECT_EQ(hear(30ms, kReplyAdu), Verdict::open) << "perhaps data of another frame";
    Verdict verdict = Verdict::open;
    Duration after = 30ms;
    while (verdict == Verdict::open && after < 300ms) verdict = hear(after += 1500us, "00"_hex);
    ASSERT_EQ(verdict, Verdict::replied);
    EXPECT_GT(after, 100ms);
    const TimePoint now = attempt_.timing().sent + after;
    EXPECT_EQ(attempt_.came_at(now), attempt_.timing().sent + 30ms);
    EXPECT_LT(attempt_.waited(now), 30ms);
    const auto parts = attempt_.take_unsolicited();
    ASSERT_EQ(parts.size(), 2u) << "before it and behind it";
    EXPECT_EQ(parts[0].came, attempt_.timing().sent + 29ms);
    EXPECT_EQ(parts[1].came, now);
}

TEST_F(AttemptTest, IsWaitedForLongerWhereItsStationIsSeenToNeedThat) {
    attempt_.allow_for(600ms);
    EXPECT_EQ(run_to_verdict(), Verdict::silent);
    EXPECT_EQ(ended_, Duration(600ms));
}

TEST_F(AttemptTest, WhatComesBackWhileItLeavesIsNoNoiseBehindTheLastReply) {
    const Bytes frame = encode_adu(kStation, kRead);
    attempt_ = Attempt(group_of(kStation, kRead), timing_of(100ms),
                       EchoFilter(frame, EchoFilter::Expect::nothing));
    hear(-5ms, {frame.begin(), frame.begin() + 2});
    hear(-4ms, {frame.begin() + 2, frame.begin() + 5});
    EXPECT_FALSE(attempt_.early_noise());
    hear(-3ms, "00"_hex);
    EXPECT_TRUE(attempt_.early_noise());
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
    EXPECT_EQ(hear(90ms, kReplyAdu), Verdict::replied);
}

TEST_F(AttemptTest, AGoodFrameOfTheStationThatDoesNotAnswerEndsItUnlessUnsolicited) {
    Attempt other = attempt_;
    EXPECT_EQ(hear(10ms, encode_adu(kStation, kOfOtherShape)), Verdict::wrong);
    std::swap(attempt_, other);
    other_frame_ends_ = false;
    EXPECT_EQ(hear(10ms, encode_adu(kStation, kOfOtherShape)), Verdict::open);
    EXPECT_EQ(hear(50ms, kReplyAdu), Verdict::replied);
}

TEST_F(AttemptTest, P1ARejectedReplyCountsAsHeardAndTheNextOneAnswers) {
    ASSERT_EQ(hear(10ms, kReplyAdu), Verdict::replied);
    attempt_.reject_reply();
    expect_unsolicited(kReplyAdu);
    EXPECT_EQ(hear(50ms, encode_adu(kStation, kOtherReply)), Verdict::replied);
    EXPECT_EQ(attempt_.reply(), kOtherReply);
}

TEST_F(AttemptTest, P1ACandidateAnswersWhenNothingElseCameInTheTimeThatTheStationNeeds) {
    ASSERT_EQ(hear(10ms, kReplyAdu), Verdict::replied);
    attempt_.keep_candidate(60ms, Answers::Kept::believed);
    Attempt other = attempt_;
    EXPECT_EQ(hear(15ms, "FF FF"_hex), Verdict::open);
    EXPECT_EQ(attempt_.on_deadline(attempt_.timing().sent + 60ms - 1ns, ends_), Verdict::open);
    EXPECT_EQ(run_to_verdict(), Verdict::replied);
    EXPECT_EQ(ended_, Duration(60ms));
    EXPECT_EQ(attempt_.reply(), kReply);
    std::swap(attempt_, other);
    EXPECT_EQ(hear(50ms, encode_adu(kStation, kOtherReply)), Verdict::replied);
    EXPECT_EQ(attempt_.reply(), kOtherReply);
    expect_unsolicited(kReplyAdu);
}

TEST_F(AttemptTest, P1WhereDuplicatesAreKnownTheCandidateIsNoAnswer) {
    ASSERT_EQ(hear(10ms, kReplyAdu), Verdict::replied);
    attempt_.keep_candidate(60ms, Answers::Kept::doubted);
    EXPECT_EQ(run_to_verdict(), Verdict::doubtful) << "and it is asked once more";
    EXPECT_EQ(ended_, Duration(70ms)) << "a duplicate may have kept it from saying its own";
    EXPECT_TRUE(attempt_.take_unsolicited().empty()) << "it proves no duplicate either";
}

TEST_F(AttemptTest, P1ACandidateThatComesOnceMoreIsTheAnswerAndShowsNoDuplicate) {
    ASSERT_EQ(hear(10ms, kReplyAdu), Verdict::replied);
    attempt_.keep_candidate(60ms, Answers::Kept::doubted);
    EXPECT_EQ(hear(30ms, kReplyAdu), Verdict::replied);
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

TEST_F(AttemptTest, FRM11AReplyOfUnknownLengthEndsWithItsCrcOrAHole) {
    const Bytes reply = encode_adu(kStation, "41 01 02 03 04 05"_hex);
    attempt_ = Attempt(group_of(kStation, "41 01"_hex), timing_of(100ms), {});
    hear(10ms, Bytes(reply.begin(), reply.begin() + 4));
    EXPECT_EQ(attempt_.deadline() - attempt_.timing().sent, Duration(70ms)) << "a hole";
    hear(40ms, Bytes(reply.begin() + 4, reply.end()));
    EXPECT_EQ(attempt_.deadline() - attempt_.timing().sent, Duration(60ms)) << "the frame's end";
    EXPECT_EQ(run_to_verdict(), Verdict::replied);
}

const Duration kCharacter = character_time(SerialFormat{});

/// Which bytes must be read at once and which need not, while a reply of 11 bytes comes.
class AttemptPaceTest : public testing::Test {
  protected:
    static Attempt attempt_of(const Attempt::Timing& timing, EchoFilter echo = {}) {
        return {group_of(kStation, kRead), timing, std::move(echo)};
    }
    static Attempt::Timing as_asked() {
        Attempt::Timing timing = timing_of(500ms);
        timing.as_asked = true;
        return timing;
    }
    /// These bytes are read, so many characters after start_.
    Verdict read(std::size_t characters, ByteView bytes, Duration late = {}) {
        now_ = start_ + characters * kCharacter + late;
        return attempt_.on_rx(now_, bytes, [](ByteView) { return true; });
    }
    /// Bytes `from` to `to` of the reply, whose byte n is there n + 1 characters after start_.
    Verdict hear(std::size_t from, std::size_t to, Duration late = {}) {
        return read(to, ByteView(kReplyAdu).subspan(from, to - from), late);
    }
    /// After the reply's start.
    std::optional<Duration> busy() const {
        const auto until = attempt_.busy_until();
        return until && *until > now_ ? std::optional(*until - start_) : std::nullopt;
    }

    Attempt attempt_ = attempt_of(timing_of(500ms));
    TimePoint start_ = attempt_.timing().sent + 5ms;
    TimePoint now_{};
    const Bytes frame_ = encode_adu(kStation, kRead);
};

/// These bytes of the reply are read, and nothing more is wanted for so long.
struct Look {
    std::size_t from;
    std::size_t to;
    Duration late;
    std::optional<Duration> busy;  ///< after the reply's start
};

TEST_F(AttemptPaceTest, TheReplyIsLookedAtWhenItsHeaderAndWhenAllOfItIsThere) {
    const Duration header = 3 * kCharacter;
    const Duration whole = 11 * kCharacter;
    Attempt::Timing sooner = timing_of(500ms);
    sooner.wake_latency = 40us;
    for (int i = 0; i < 50; ++i) sooner.drift.on_look(whole, true);
    Attempt::Wire tcp = test::default_wire();
    tcp.may_stall = true;
    struct Row {
        const char* what;
        Attempt::Timing timing;
        std::vector<Look> looks;
    };
    const Row rows[] = {
        {"as a rule", timing_of(500ms), {{0, 1, 0ms, header}, {1, 3, 0ms, whole}}},
        {"usually as asked", as_asked(), {{0, 1, 0ms, whole}}},
        {"a look before its time", as_asked(), {{0, 1, 0ms, whole}, {1, 5, 0ms, whole}}},
        {"a late look, then a better one",
         timing_of(500ms),
         {{0, 1, kCharacter / 2, header + kCharacter / 2}, {1, 3, 0ms, whole}}},
        {"its end, where replies end sooner",
         sooner,
         {{0, 1, 0ms, header}, {1, 3, 0ms, whole - 40us - sooner.drift.early(whole)}}},
        {"over TCP nothing has a rate", timing_of(500ms, tcp), {{0, 1, 0ms, std::nullopt}}},
    };
    for (const Row& row : rows) {
        SCOPED_TRACE(row.what);
        attempt_ = attempt_of(row.timing);
        EXPECT_EQ(attempt_.busy_until(), std::nullopt) << "each byte, until it has begun";
        for (const Look& look : row.looks) {
            hear(look.from, look.to, look.late);
            EXPECT_EQ(busy(), look.busy);
            EXPECT_FALSE(attempt_.pace().end_look());
        }
        EXPECT_EQ(hear(row.looks.back().to, 11), Verdict::replied);
    }
}

TEST_F(AttemptPaceTest, ReportsWhetherTheReplyWasThereWhenItsEndWasLookedAt) {
    for (const std::size_t there : {std::size_t{10}, std::size_t{11}}) {
        attempt_ = attempt_of(as_asked());
        hear(0, 1);
        EXPECT_FALSE(attempt_.pace().end_look());
        hear(1, there, kCharacter);
        ASSERT_TRUE(attempt_.pace().end_look());
        EXPECT_EQ(attempt_.pace().end_look()->reply, 11 * kCharacter);
        EXPECT_EQ(attempt_.pace().end_look()->whole, there == 11);
        EXPECT_EQ(busy(), std::nullopt) << "the last byte is wanted when it comes";
    }
}

TEST_F(AttemptPaceTest, AnUnexpectedExceptionShowsNothingAboutTheEndAndWhenItBeganIsKnown) {
    attempt_ = attempt_of(as_asked());
    hear(0, 1);
    EXPECT_EQ(read(11, "83 02 C1 34"_hex), Verdict::replied);
    EXPECT_TRUE(attempt_.pace().is_shorter());
    EXPECT_FALSE(attempt_.pace().end_look());
    EXPECT_EQ(attempt_.first_sign(now_), 5ms + kCharacter);
}

TEST_F(AttemptPaceTest, AShortReplyIsSleptThroughAllTheSame) {
    Attempt::Wire line = test::default_wire();
    line.serial.baud = 921600;
    Attempt::Timing timing = timing_of(500ms, line);
    timing.wake_latency = WakeLatency::kMost;
    timing.as_asked = true;
    attempt_ = attempt_of(timing);
    const Duration character = character_time(line.serial);
    const Duration reply = 11 * character;
    read(0, ByteView(kReplyAdu).first(1));
    EXPECT_EQ(attempt_.busy_until(), now_ - character + reply - reply / 4);
}

TEST_F(AttemptPaceTest, AnExceptionIsNotWaitedForLongerThanItIs) {
    read(3, "11 83 02"_hex);
    EXPECT_EQ(busy(), 5 * kCharacter);
}

TEST_F(AttemptPaceTest, BytesThatAreLateAreWantedOneByOneUntilTheNextDecides) {
    hear(0, 3);
    start_ += 4ms;  // a hole
    read(7, ByteView(kReplyAdu).subspan(3, 1));
    EXPECT_EQ(busy(), std::nullopt);
    read(7, ByteView(kReplyAdu).subspan(4, 3));
    EXPECT_EQ(busy(), 11 * kCharacter);
}

TEST_F(AttemptPaceTest, WhatIsNoReplyIsWantedByteByByte) {
    read(0, "FF 00"_hex);
    EXPECT_EQ(attempt_.busy_until(), std::nullopt);
}

TEST_F(AttemptPaceTest, WhatComesFasterThanTheLineIsWantedAtOnce) {
    attempt_ = Attempt(group_of(kStation, "03 00 6B 00 64"_hex), timing_of(500ms), {});
    read(0, "11 03 C8"_hex);
    EXPECT_TRUE(busy());
    EXPECT_FALSE(attempt_.pace().hasty());
    read(0, Bytes(62, 7), 1ms);  // an adapter on USB that knows of no rate
    EXPECT_TRUE(attempt_.pace().hasty());
    EXPECT_EQ(attempt_.busy_until(), std::nullopt);
}

TEST_F(AttemptPaceTest, ALongReplyIsLookedAtBeforeItsEndBecauseItMayHaveBeenCutShort) {
    attempt_ = Attempt(group_of(kStation, "03 00 6B 00 64"_hex), timing_of(500ms), {});
    read(3, "11 03 C8"_hex);
    EXPECT_EQ(busy(), 3 * kCharacter + 30ms);
    const std::size_t come = static_cast<std::size_t>(30ms / kCharacter);
    read(3 + come, Bytes(come, 7));
    EXPECT_EQ(busy(), 2 * (3 + come) * kCharacter) << "as long again";
}

TEST_F(AttemptPaceTest, WhenLessHasComeThanTheLineBringsEachByteIsWanted) {
    hear(0, 3);
    read(10, ByteView(kReplyAdu).subspan(3, 2));
    EXPECT_EQ(attempt_.busy_until(), std::nullopt);
}

TEST_F(AttemptPaceTest, WhatBeginsLikeAnUnexpectedEchoIsLookedAtWhenTheReplyIsThere) {
    attempt_ = attempt_of(as_asked(), {frame_, EchoFilter::Expect::perhaps});
    hear(0, 1);
    EXPECT_EQ(busy(), 11 * kCharacter);
    EXPECT_EQ(hear(1, 11), Verdict::replied);
    EXPECT_EQ(attempt_.first_sign(now_), 5ms + kCharacter) << "it began with the first byte";
}

TEST_F(AttemptPaceTest, AnEchoThatIsCertainIsLookedAtWhenAllOfItIsThere) {
    attempt_ = attempt_of(as_asked(), {frame_, EchoFilter::Expect::certainly});
    start_ = attempt_.timing().started;
    read(1, ByteView(frame_).first(1));
    EXPECT_EQ(busy(), 8 * kCharacter);
    read(8, ByteView(frame_).subspan(1));
    EXPECT_EQ(busy(), std::nullopt);
    start_ = attempt_.timing().sent + 5ms;
    hear(0, 1);
    EXPECT_EQ(busy(), 11 * kCharacter);
    EXPECT_EQ(hear(1, 11), Verdict::replied);
}

TEST_F(AttemptPaceTest, AnEchoIsLookedAtWhenItCanHaveComeBack) {
    attempt_ = attempt_of(timing_of(500ms), {frame_, EchoFilter::Expect::perhaps});
    start_ = attempt_.timing().started;
    read(3, ByteView(frame_).first(3));
    EXPECT_EQ(busy(), 8 * kCharacter);
    read(8, ByteView(frame_).subspan(3));
    EXPECT_EQ(attempt_.busy_until(), std::nullopt);
}

TEST_F(AttemptTest, P1AGlitchBehindADoubtedReplyIsNoReasonToCallItDamaged) {
    const Bytes frame = encode_adu(kStation, kRead);
    EXPECT_EQ(hear(5ms, {frame.begin(), frame.begin() + 4}), Verdict::open) << "of our echo";
    ASSERT_EQ(hear(10ms, kReplyAdu), Verdict::replied);
    attempt_.keep_candidate(60ms, Answers::Kept::doubted);
    EXPECT_EQ(hear(12ms, Bytes(kReplyAdu.size(), 0xFF)), Verdict::open);
    EXPECT_EQ(run_to_verdict(), Verdict::doubtful);
}

TEST_F(AttemptTest, P1AReplyThatRepeatsTheCandidateCameWhenThatDid) {
    ASSERT_EQ(hear(10ms, kReplyAdu), Verdict::replied);
    const Duration first = attempt_.begun_after(attempt_.last_byte());
    attempt_.keep_candidate(60ms, Answers::Kept::doubted);
    ASSERT_EQ(hear(50ms, kReplyAdu), Verdict::replied);
    EXPECT_EQ(attempt_.begun_after(attempt_.last_byte()), first);
    EXPECT_EQ(attempt_.first_sign(attempt_.last_byte()), first);
    EXPECT_EQ(attempt_.came_at(attempt_.last_byte()), attempt_.last_byte()) << "both are over";
}

TEST_F(AttemptTest, P1APauseInsideAReplyMakesItNoLaterUnlessNoiseCameBeforeIt) {
    const Bytes front(kReplyAdu.begin(), kReplyAdu.begin() + 5);
    const Bytes rest(kReplyAdu.begin() + 5, kReplyAdu.end());
    Attempt noisy = attempt_;
    hear(10ms, front);
    ASSERT_EQ(hear(50ms, rest), Verdict::replied);
    EXPECT_EQ(attempt_.begun_after(attempt_.last_byte()), Duration(10ms));
    EXPECT_GT(attempt_.first_sign(attempt_.last_byte()), Duration(10ms));
    std::swap(attempt_, noisy);
    hear(1ms, "FF FF"_hex);
    hear(10ms, front);
    ASSERT_EQ(hear(50ms, rest), Verdict::replied);
    EXPECT_EQ(attempt_.begun_after(attempt_.last_byte()),
              attempt_.first_sign(attempt_.last_byte()));
}

/// An adapter that switches late returns the first 1 to 7 bytes of what it sends.
class APartOfTheEcho : public testing::TestWithParam<EchoFilter::Expect> {
  protected:
    Verdict hear(Duration after, const Bytes& bytes) {
        return attempt_.on_rx(attempt_.timing().sent + after, bytes, ends_);
    }

    static Attempt::Timing paced() {
        Attempt::Wire line = test::default_wire();
        line.paced = true;
        return timing_of(100ms, line);
    }
    const Bytes frame_ = encode_adu(kStation, kRead);
    Attempt attempt_{group_of(kStation, kRead), paced(), {frame_, GetParam()}};
    Attempt::Ends ends_ = [](ByteView) { return true; };
};

TEST_P(APartOfTheEcho, TakesNoByteOfTheReplyWithIt) {
    hear(-3ms, {frame_.begin(), frame_.begin() + 6});
    EXPECT_EQ(hear(5ms, {kReplyAdu.begin(), kReplyAdu.begin() + 2}), Verdict::open);
    EXPECT_EQ(hear(9ms, {kReplyAdu.begin() + 2, kReplyAdu.end()}), Verdict::replied);
    EXPECT_FALSE(attempt_.take_stale().empty());
}

TEST_P(APartOfTheEcho, ReadLateTakesNoByteOfTheReplyWithIt) {
    hear(-5ms, {frame_.begin(), frame_.begin() + 4});
    hear(3ms, {frame_.begin() + 4, frame_.begin() + 7});
    const auto middle = kReplyAdu.end() - 2;
    EXPECT_EQ(hear(12ms, {kReplyAdu.begin(), middle}), Verdict::open);
    EXPECT_EQ(hear(14ms, {middle, kReplyAdu.end()}), Verdict::replied);
}

TEST_P(APartOfTheEcho, AloneIsSilenceAndNoReplyThatCameDamaged) {
    for (const std::ptrdiff_t size : {3, 7}) {
        Attempt attempt = attempt_;
        attempt.on_rx(attempt.timing().sent, {frame_.begin(), frame_.begin() + size}, ends_);
        Verdict verdict = Verdict::open;
        while (verdict == Verdict::open) verdict = attempt.on_deadline(attempt.deadline(), ends_);
        EXPECT_EQ(verdict, Verdict::silent) << size;
    }
}

INSTANTIATE_TEST_SUITE_P(Every, APartOfTheEcho,
                         testing::Values(EchoFilter::Expect::nothing, EchoFilter::Expect::perhaps));

TEST_F(AttemptTest, AFrameThatBrokeOffDoesNotHoldUpTheReplyBehindIt) {
    EXPECT_EQ(hear(5ms, "12 03 20"_hex), Verdict::open) << "of another station";
    EXPECT_EQ(hear(60ms, kReplyAdu), Verdict::replied);
}

TEST_F(AttemptTest, AFrameOfAnotherFunctionLeavesTheReplyItsUsualTime) {
    EXPECT_EQ(hear(10ms, encode_adu(kStation, "04 02 00 01"_hex)), Verdict::open);
    EXPECT_EQ(run_to_verdict(), Verdict::wrong) << "it may be meant for another master";
    EXPECT_EQ(ended_, 100ms);
}

TEST(AttemptTimes, WhereBytesComeOneByOneTheEndOfAReplyTellsWhenItBegan) {
    Attempt::Timing timing = timing_of(100ms);
    const TimePoint end = timing.sent + 5ms + frame_time(timing.serial, kReplyAdu.size());
    for (const bool steady : {false, true}) {
        timing.steady = steady;
        Attempt attempt(group_of(kStation, kRead), timing, {});
        ASSERT_EQ(attempt.on_rx(end, kReplyAdu, [](ByteView) { return false; }), Verdict::replied);
        EXPECT_EQ(attempt.first_byte(), steady ? timing.sent + 5ms : end);
    }
}

}  // namespace
}  // namespace panelgate::arbiter::attempt_test
