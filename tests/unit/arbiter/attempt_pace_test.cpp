#include <gtest/gtest.h>

#include <optional>

#include "panelgate/arbiter/attempt.hpp"
#include "support/attempts.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::attempt_pace_test {
namespace {

using test::group_of;

constexpr std::uint8_t kStation = 17;
const Bytes kReply = "11 03 06 02 2B 00 00 00 64 C8 BA"_hex;

/// Which bytes must be read at once and which need not, while a reply of 11 bytes comes.
class AttemptPaceTest : public testing::Test {
  protected:
    static Attempt attempt_of(bool may_stall, EchoFilter echo = {}, bool as_asked = false) {
        Settings line;
        line.may_stall = may_stall;
        Attempt::Timing timing = Attempt::timing_of(line, TimePoint{1h}, 8, Duration::zero());
        timing.as_asked = as_asked;
        timing.patience = timing.usual = 500ms;
        return {group_of(kStation, "03 00 6B 00 03"_hex), timing, std::move(echo)};
    }
    /// Bytes `from` to `to` of the reply, whose byte n is there n + 1 characters after `start_`;
    /// `late`: when they are read.
    Verdict hear(std::size_t from, std::size_t to, Duration late = {}) {
        now_ = start_ + to * kCharacter + late;
        return attempt_.on_rx(now_, ByteView(kReply).subspan(from, to - from),
                              [](ByteView) { return true; });
    }
    /// After the reply's start.
    std::optional<Duration> busy() const {
        const auto until = attempt_.busy_until();
        return until && *until > now_ ? std::optional(*until - start_) : std::nullopt;
    }

    const Duration kCharacter = character_time(SerialFormat{});
    Attempt attempt_ = attempt_of(false);
    TimePoint start_ = attempt_.timing().sent + 5ms;
    TimePoint now_{};
};

TEST_F(AttemptPaceTest, WantsEachByteUntilSomethingHasBegun) {
    EXPECT_EQ(attempt_.busy_until(), std::nullopt);
}

TEST_F(AttemptPaceTest, ThreeLooksAtAReplyAreEnough) {
    hear(0, 1);
    EXPECT_EQ(busy(), 3 * kCharacter) << "its header";
    hear(1, 3);
    EXPECT_EQ(busy(), 11 * kCharacter) << "all of it";
    EXPECT_EQ(hear(3, 11), Verdict::replied);
}

TEST_F(AttemptPaceTest, TwoLooksAreEnoughWhereTheReplyIsWhatWasAskedFor) {
    attempt_ = attempt_of(false, {}, true);
    hear(0, 1);
    EXPECT_EQ(busy(), 11 * kCharacter) << "all of it";
    EXPECT_EQ(hear(1, 11), Verdict::replied);
}

TEST_F(AttemptPaceTest, ReportsWhetherTheReplyWasThereWhenItsEndWasLookedAt) {
    for (const std::size_t there : {std::size_t{10}, std::size_t{11}}) {
        attempt_ = attempt_of(false, {}, true);
        hear(0, 1);
        EXPECT_FALSE(attempt_.end_look());
        hear(1, there, kCharacter);
        ASSERT_TRUE(attempt_.end_look());
        EXPECT_EQ(attempt_.end_look()->reply, 11 * kCharacter);
        EXPECT_EQ(attempt_.end_look()->whole, there == 11);
        EXPECT_EQ(busy(), std::nullopt) << "the last byte is wanted when it comes";
    }
}

TEST_F(AttemptPaceTest, AnUnexpectedExceptionShowsNothingAboutTheEndAndWhenItBeganIsKnown) {
    attempt_ = attempt_of(false, {}, true);
    hear(0, 1);
    now_ = start_ + 11 * kCharacter;
    const Bytes rest = "83 02 C1 34"_hex;
    EXPECT_EQ(attempt_.on_rx(now_, rest, [](ByteView) { return true; }), Verdict::replied);
    EXPECT_TRUE(attempt_.unexpected_exception());
    EXPECT_FALSE(attempt_.end_look());
    EXPECT_EQ(attempt_.first_sign(now_), 5ms + kCharacter);
}

TEST_F(AttemptPaceTest, ALookBeforeItsTimeShowsNothingAboutTheEnd) {
    attempt_ = attempt_of(false, {}, true);
    hear(0, 1);
    hear(1, 5);
    EXPECT_FALSE(attempt_.end_look());
    EXPECT_EQ(busy(), 11 * kCharacter);
}

TEST_F(AttemptPaceTest, RepliesThatEndSoonerAreLookedAtSooner) {
    Drift drift;
    for (int i = 0; i < 50; ++i) drift.on_look(11 * kCharacter, true);
    Settings line;
    Attempt::Timing timing = Attempt::timing_of(line, TimePoint{1h}, 8, Duration::zero());
    timing.patience = timing.usual = 500ms;
    timing.wake_latency = 40us;
    timing.drift = drift;
    attempt_ = Attempt(group_of(kStation, "03 00 6B 00 03"_hex), timing, {});
    hear(0, 1);
    EXPECT_EQ(busy(), 3 * kCharacter) << "the header has come when it has come";
    hear(1, 3);
    EXPECT_EQ(busy(), 11 * kCharacter - 40us - drift.early(11 * kCharacter));
}

TEST_F(AttemptPaceTest, AShortReplyIsSleptThroughAllTheSame) {
    Settings line;
    line.serial.baud = 921600;
    Attempt::Timing timing = Attempt::timing_of(line, TimePoint{1h}, 8, Duration::zero());
    timing.patience = timing.usual = 500ms;
    timing.wake_latency = WakeLatency::kMost;
    timing.as_asked = true;
    attempt_ = Attempt(group_of(kStation, "03 00 6B 00 03"_hex), timing, {});
    const Duration character = character_time(line.serial);
    const Duration reply = 11 * character;
    now_ = start_;
    attempt_.on_rx(now_, ByteView(kReply).first(1), [](ByteView) { return true; });
    EXPECT_EQ(attempt_.busy_until(), now_ - character + reply - reply / 4);
}

TEST_F(AttemptPaceTest, AnExceptionIsNotWaitedForLongerThanItIs) {
    attempt_.on_rx(now_ = start_ + 3 * kCharacter, "11 83 02"_hex, [](ByteView) { return true; });
    EXPECT_EQ(busy(), 5 * kCharacter);
}

TEST_F(AttemptPaceTest, ALateLookAtTheFirstByteIsMadeUpForByAnyBetterOne) {
    hear(0, 1, kCharacter / 2);
    EXPECT_EQ(busy(), 3 * kCharacter + kCharacter / 2);
    hear(1, 3);
    EXPECT_EQ(busy(), 11 * kCharacter);
}

TEST_F(AttemptPaceTest, BytesThatAreLateAreWantedOneByOneUntilTheNextDecides) {
    hear(0, 3);
    start_ += 4ms;  // a hole
    now_ = start_ + 7 * kCharacter;
    attempt_.on_rx(now_, ByteView(kReply).subspan(3, 1), [](ByteView) { return true; });
    EXPECT_EQ(busy(), std::nullopt);
    attempt_.on_rx(now_, ByteView(kReply).subspan(4, 3), [](ByteView) { return true; });
    EXPECT_EQ(busy(), 11 * kCharacter);
}

TEST_F(AttemptPaceTest, WhatIsNoReplyIsWantedByteByByte) {
    attempt_.on_rx(now_ = start_, "FF 00"_hex, [](ByteView) { return true; });
    EXPECT_EQ(attempt_.busy_until(), std::nullopt);
}

TEST_F(AttemptPaceTest, WhatComesFasterThanTheLineIsWantedAtOnce) {
    const Bytes long_reply = "11 03 C8"_hex;
    attempt_ = [&] {
        Settings line;
        Attempt::Timing timing = Attempt::timing_of(line, TimePoint{1h}, 8, Duration::zero());
        timing.patience = timing.usual = 500ms;
        return Attempt(group_of(kStation, "03 00 6B 00 64"_hex), timing, {});
    }();
    now_ = start_;
    attempt_.on_rx(now_, long_reply, [](ByteView) { return true; });
    EXPECT_TRUE(busy());
    EXPECT_FALSE(attempt_.hasty());
    now_ += 1ms;  // an adapter on USB that knows of no rate
    attempt_.on_rx(now_, Bytes(62, 7), [](ByteView) { return true; });
    EXPECT_TRUE(attempt_.hasty());
    EXPECT_EQ(attempt_.busy_until(), std::nullopt);
}

TEST_F(AttemptPaceTest, ALongReplyIsLookedAtBeforeItsEndBecauseItMayHaveBeenCutShort) {
    Settings line;
    Attempt::Timing timing = Attempt::timing_of(line, TimePoint{1h}, 8, Duration::zero());
    timing.patience = timing.usual = 500ms;
    attempt_ = Attempt(group_of(kStation, "03 00 6B 00 64"_hex), timing, {});
    now_ = start_ + 3 * kCharacter;
    attempt_.on_rx(now_, "11 03 C8"_hex, [](ByteView) { return true; });
    EXPECT_EQ(busy(), 3 * kCharacter + 30ms);
    const std::size_t come = static_cast<std::size_t>(30ms / kCharacter);
    now_ = start_ + (3 + come) * kCharacter;
    attempt_.on_rx(now_, Bytes(come, 7), [](ByteView) { return true; });
    EXPECT_EQ(busy(), 2 * (3 + come) * kCharacter) << "as long again";
}

TEST_F(AttemptPaceTest, WhenLessHasComeThanTheLineBringsEachByteIsWanted) {
    hear(0, 3);
    now_ = start_ + 10 * kCharacter;
    attempt_.on_rx(now_, ByteView(kReply).subspan(3, 2), [](ByteView) { return true; });
    EXPECT_EQ(attempt_.busy_until(), std::nullopt);
}

TEST_F(AttemptPaceTest, OverTcpNothingComesAtTheRateOfTheLine) {
    attempt_ = attempt_of(true);
    hear(0, 1);
    EXPECT_EQ(attempt_.busy_until(), std::nullopt);
}

TEST_F(AttemptPaceTest, WhatBeginsLikeAnUnexpectedEchoIsLookedAtWhenTheReplyIsThere) {
    attempt_ =
        attempt_of(false, {"11 03 00 6B 00 03 76 87"_hex, EchoFilter::Expect::perhaps}, true);
    hear(0, 1);
    EXPECT_EQ(busy(), 11 * kCharacter);
    EXPECT_EQ(hear(1, 11), Verdict::replied);
    EXPECT_EQ(attempt_.first_sign(now_), 5ms + kCharacter) << "it began with the first byte";
}

TEST_F(AttemptPaceTest, AnEchoThatIsCertainIsLookedAtWhenAllOfItIsThere) {
    const Bytes frame = "11 03 00 6B 00 03 76 87"_hex;
    attempt_ = attempt_of(false, {frame, EchoFilter::Expect::certainly}, true);
    start_ = attempt_.timing().started;
    now_ = start_ + kCharacter;
    attempt_.on_rx(now_, ByteView(frame).first(1), [](ByteView) { return true; });
    EXPECT_EQ(busy(), 8 * kCharacter);
    now_ = start_ + 8 * kCharacter;
    attempt_.on_rx(now_, ByteView(frame).subspan(1), [](ByteView) { return true; });
    EXPECT_EQ(busy(), std::nullopt);
    start_ = attempt_.timing().sent + 5ms;
    hear(0, 1);
    EXPECT_EQ(busy(), 11 * kCharacter);
    EXPECT_EQ(hear(1, 11), Verdict::replied);
}

TEST_F(AttemptPaceTest, AnEchoIsLookedAtWhenItCanHaveComeBack) {
    const Bytes frame = "11 03 00 6B 00 03 76 87"_hex;
    attempt_ = attempt_of(false, {frame, EchoFilter::Expect::perhaps});
    start_ = attempt_.timing().started;
    now_ = start_ + 3 * kCharacter;
    attempt_.on_rx(now_, ByteView(frame).first(3), [](ByteView) { return true; });
    EXPECT_EQ(busy(), 8 * kCharacter);
    now_ = start_ + 8 * kCharacter;
    attempt_.on_rx(now_, ByteView(frame).subspan(3), [](ByteView) { return true; });
    EXPECT_EQ(attempt_.busy_until(), std::nullopt);
}

}  // namespace
}  // namespace panelgate::arbiter::attempt_pace_test
