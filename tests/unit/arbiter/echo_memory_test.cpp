// What is taken for the echo of our own frames, and when a line is known to have one (P8).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>

#include "arbiter_fixture.hpp"
#include "panelgate/arbiter/habits/echo.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::echo_memory_test {
namespace {

using Expect = EchoFilter::Expect;
using test::request_of;

const Bytes kFrame = "11 06 00 01 00 03 9A 9B"_hex;
constexpr int kNoMore = 16;  ///< replies without an echo after which a known one is gone

Bytes copy(ByteView bytes) { return {bytes.begin(), bytes.end()}; }

TEST(EchoFilter, TakesTheWholeFrameOutInAnyPieces) {
    const Bytes all = Writer().raw(kFrame).u8(0xAA).u8(0xBB).take();
    for (std::size_t piece = 1; piece <= kFrame.size(); ++piece) {
        EchoFilter filter(kFrame, Expect::certainly);
        Writer rest;
        for (std::size_t at = 0; at < all.size(); at += piece)
            rest.raw(filter.feed(ByteView(all).subspan(at, std::min(piece, all.size() - at))));
        EXPECT_EQ(rest.take(), "AA BB"_hex);
        EXPECT_TRUE(filter.complete());
        EXPECT_FALSE(filter.mismatch());
    }
}

TEST(EchoFilter, DetectsADifferenceAndReturnsWhatItBuffered) {
    for (const Expect expect : {Expect::certainly, Expect::perhaps}) {
        EchoFilter filter(kFrame, expect);
        EXPECT_TRUE(filter.feed("11 06 00"_hex).empty());
        EXPECT_EQ(filter.pending(), expect == Expect::perhaps);
        EXPECT_EQ(copy(filter.feed("FF 01"_hex)), "11 06 00 FF 01"_hex);
        EXPECT_EQ(filter.mismatch(), expect == Expect::certainly);
        EXPECT_FALSE(filter.pending());
    }
}

TEST(EchoFilter, GivesBackWhatNeverBecameTheEcho) {
    EchoFilter filter(kFrame, Expect::perhaps);
    EXPECT_TRUE(filter.feed("11 06 00"_hex).empty());
    EXPECT_EQ(filter.release(), "11 06 00"_hex);
    EXPECT_TRUE(filter.release().empty());
    EXPECT_EQ(copy(filter.feed("01 00"_hex)), "01 00"_hex);
}

class EchoMemoryTest : public testing::Test {
  protected:
    void reply_without_echo(int times) {
        for (int i = 0; i < times; ++i) memory.on_reply_without_echo(request_of(kRead), false);
    }
    bool must_be_learned() const {
        return memory.must_be_learned_before(request_of(kWrite), false);
    }
    EchoMemory memory{EchoMode::automatic};
};

TEST_F(EchoMemoryTest, LearnsOnlyFromRequestsWhoseAnswerCannotBeTheirEcho) {
    EXPECT_FALSE(memory.on_echo(request_of(kWrite)));
    EXPECT_EQ(memory.state(), EchoState::unknown);
    EXPECT_FALSE(memory.on_echo(request_of("01 03 00 00 18"_hex)))
        << "24 coils: its reply has 8 bytes, too";
    EXPECT_EQ(memory.state(), EchoState::unknown);
    EXPECT_TRUE(memory.on_echo(request_of(kRead)));
    EXPECT_FALSE(memory.on_echo(request_of(kRead))) << "no news";
    EXPECT_EQ(memory.expect(TimePoint{}, request_of(kWrite)), Expect::certainly);
    memory.forget();
    EXPECT_TRUE(must_be_learned());
}

TEST_F(EchoMemoryTest, P8AnEchoThatMayHaveBeenTheAnswerItselfIsLearnedAgain) {
    ASSERT_TRUE(memory.on_echo(request_of(kRead)));
    memory.on_unanswered(request_of(kRead));
    EXPECT_EQ(memory.state(), EchoState::present) << "no read is answered by itself";
    memory.on_unanswered(request_of(kWrite));
    EXPECT_EQ(memory.state(), EchoState::unclear);
    EXPECT_TRUE(must_be_learned());
    reply_without_echo(kNoMore - 1);
    EXPECT_EQ(memory.state(), EchoState::unclear) << "bytes may be lost now and then";
    reply_without_echo(1);
    EXPECT_EQ(memory.state(), EchoState::absent);
}

TEST_F(EchoMemoryTest, P8AFewRepliesWithoutAnEchoDoNotShowThatAKnownEchoIsGone) {
    EXPECT_TRUE(memory.on_echo(request_of(kRead)));
    memory.on_mismatch();
    EXPECT_TRUE(memory.expects_one()) << "it has been heard";
    reply_without_echo(kNoMore - 1);
    EXPECT_TRUE(memory.expects_one());
    EXPECT_TRUE(must_be_learned());
    reply_without_echo(1);
    EXPECT_FALSE(memory.expects_one());
    memory.forget();
    EXPECT_FALSE(memory.expects_one()) << "another device";
}

TEST_F(EchoMemoryTest, P8ARequestThatComesBackOnceMoreIsRememberedForTenMinutes) {
    const TimePoint now{1h};
    EXPECT_FALSE(memory.on_again(now, kWrite)) << "it may have been the answer";
    EXPECT_FALSE(memory.comes_again(now, 17));
    EXPECT_TRUE(memory.on_again(now, kRead));
    EXPECT_TRUE(memory.comes_again(now + 10min, 17));
    EXPECT_FALSE(memory.comes_again(now + 11min, 17));
    EXPECT_TRUE(memory.on_again(now, "10 00 01 00 01 02 00 03"_hex));
    memory.forget();
    EXPECT_FALSE(memory.comes_again(now, 17)) << "another device";
}

TEST_F(EchoMemoryTest, P5APanelThatRepeatsRequestsMakesNoEchoWhereTheOthersShowNone) {
    EXPECT_TRUE(memory.on_echo(request_of(kRead), false, 17));
    for (int i = 0; i < kNoMore; ++i) {
        memory.on_mismatch();
        memory.on_reply_without_echo(request_of(kRead), false, 18);
        if (i + 1 < kNoMore) memory.on_echo(request_of(kRead), false, 17);
    }
    EXPECT_FALSE(memory.expects_one());
    for (int i = 0; i < 5; ++i) EXPECT_FALSE(memory.on_echo(request_of(kRead), false, 17));
    EXPECT_FALSE(memory.on_echo(request_of(kRead), true, 17)) << "a write's was its habit, too";
    EXPECT_EQ(memory.state(), EchoState::absent);
    EXPECT_TRUE(memory.comes_again(TimePoint{}, 17)) << "what equals a write may be that";
    EXPECT_FALSE(memory.comes_again(TimePoint{}, 18));
    for (int i = 0; i < 2; ++i) EXPECT_FALSE(memory.on_echo(request_of(kRead), false, 18));
    EXPECT_TRUE(memory.on_echo(request_of(kRead), false, 17)) << "those of all come back";
}

TEST_F(EchoMemoryTest, P8APanelThatRepeatsRequestsNoMoreIsForgotten) {
    EXPECT_TRUE(memory.on_echo(request_of(kRead), false, 17));
    const auto reply_of = [&](std::uint8_t station) {
        for (int i = 0; i < kNoMore; ++i)
            memory.on_reply_without_echo(request_of(kRead), false, station);
    };
    memory.on_mismatch();
    reply_of(18);
    EXPECT_TRUE(memory.comes_again(TimePoint{}, 17));
    reply_of(17);
    EXPECT_FALSE(memory.comes_again(TimePoint{}, 17));
}

/// A line that gives back what is sent, and stalls: each frame whose echo has not come is that.
TEST(LateEcho, IsOwnAsLongAsItIsMissing) {
    const Bytes first = "11 03 00 6B 00 03 76 87"_hex;
    const Bytes second = "11 03 00 6C 00 03 C7 46"_hex;
    LateEcho echo;
    echo.on_sent(TimePoint{}, first, true);
    echo.on_sent(TimePoint{} + 1s, second, true);
    EXPECT_TRUE(echo.is_own(TimePoint{} + 2s, first));
    EXPECT_TRUE(echo.is_own(TimePoint{} + 2s, second));
    echo.on_came();
    EXPECT_TRUE(echo.is_own(TimePoint{} + 2s, first));
    EXPECT_FALSE(echo.is_own(TimePoint{} + 2s, second));
    EXPECT_FALSE(echo.is_own(TimePoint{} + timing::kLatestCopy + 1ns, first));
    echo.on_sent(TimePoint{} + 3s, second);
    EXPECT_FALSE(echo.is_own(TimePoint{} + 4s, second)) << "the line gives nothing back";
}

TEST(LateEcho, ComesAfterTheSameTimeEachTime) {
    const Bytes read = "11 03 00 00 00 01"_hex;
    for (const bool steady : {true, false}) {
        LateEcho line;
        TimePoint now{100s};
        bool known = false;
        for (int i = 0; i < 6; ++i) {
            line.on_sent(now, read);
            known = line.on_heard(now + (steady ? 40ms : 30ms + 50ms * i), read);
            now += 1s;
        }
        EXPECT_EQ(known, steady) << "another master asks at any time";
        line.on_sent(now, read);
        EXPECT_EQ(line.is_own(now + 40ms, read), steady);
        EXPECT_FALSE(line.is_own(now + 40ms, "11 03 00 00 00 02"_hex));
        EXPECT_FALSE(line.is_own(now + 2s, read));
    }
}

/// A repeater that needs 5 ms: a quick panel has answered by then, another one has not.
TEST(EchoMemory, WhereAPanelsAnswersComeBeforeTheEchoThatIsExpectedBehindThem) {
    EchoMemory memory(EchoMode::on);
    const modbus::Request read = request_of(kRead);
    const TimePoint now{100s};
    for (int i = 0; i < 2; ++i) EXPECT_FALSE(memory.on_answered_before(now, read, 18));
    memory.on_echo(read, false, 18);
    for (int i = 0; i < 2; ++i) EXPECT_FALSE(memory.on_answered_before(now, read, 18));
    EXPECT_FALSE(memory.on_answered_before(now, read, 19)) << "three of one in a row";
    EXPECT_EQ(memory.expect(now, read), Expect::certainly);
    for (int i = 0; i < 2; ++i) memory.on_answered_before(now, read, 19);
    EXPECT_TRUE(memory.comes_late(now));
    EXPECT_TRUE(memory.comes_again(now, 17)) << "what equals a write is read back";
    EXPECT_EQ(memory.expect(now, read), Expect::perhaps);
}

}  // namespace
}  // namespace panelgate::arbiter::echo_memory_test
