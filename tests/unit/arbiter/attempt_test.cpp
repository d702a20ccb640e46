// One request on the wire: what is heard meanwhile, in frames, and the end of the attempt.
#include "panelgate/arbiter/attempt.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "panelgate/modbus/rtu_frame.hpp"
#include "support/attempts.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::attempt_test {
namespace {

using Expect = EchoFilter::Expect;
using modbus::encode_adu;
using modbus::Unused;
using test::group_of;

constexpr std::uint8_t kStation = 17;
constexpr TimePoint kHandedOver{1h};
constexpr Duration kPatience = 500ms;
const Bytes kRead = "03 00 6B 00 03"_hex;
const Bytes kFrame = encode_adu(kStation, kRead);
const Bytes kReplyAdu = encode_adu(kStation, "03 06 02 2B 00 00 00 64"_hex);

Attempt attempt_of(const Bytes& pdu, EchoFilter echo = {}, const Settings& line = {}) {
    return {group_of(kStation, pdu),
            test::timing_of(kHandedOver, pdu.size() + 3, line),
            std::move(echo),
            {}};
}

Bytes cut(const Bytes& whole, std::size_t front, std::size_t behind) {
    return {whole.begin() + static_cast<std::ptrdiff_t>(front),
            whole.end() - static_cast<std::ptrdiff_t>(behind)};
}

class AttemptTest : public testing::Test {
  protected:
    /// These bytes come so long after the request had left.
    void hear(Duration after, const Bytes& bytes) {
        attempt.on_rx(attempt.timing().sent + after, bytes);
        take();
    }
    /// Lets time pass until the attempt has ended.
    Verdict end() {
        for (int i = 0; i < 100; ++i) {
            const TimePoint due = attempt.deadline();
            attempt.on_silence(due);
            take();
            ended = due - attempt.timing().sent;
            if (const Verdict verdict = attempt.verdict(due); verdict != Verdict::open)
                return verdict;
        }
        ADD_FAILURE() << "the attempt never ends";
        return Verdict::open;
    }
    /// The frame that answered the request, or nothing.
    Bytes reply() const {
        const auto found = std::ranges::find(heard, true, &Attempt::Heard::answers);
        return found == heard.end() ? Bytes{} : found->part.bytes;
    }
    void again(Attempt other) {
        attempt = std::move(other);
        heard.clear();
    }

    Attempt attempt = attempt_of(kRead);
    std::vector<Attempt::Heard> heard;
    Duration ended{};

  private:
    void take() {
        for (Attempt::Heard& one : attempt.take_heard()) heard.push_back(std::move(one));
    }
};

TEST_F(AttemptTest, T1IsSilentWhenItsPatienceIsOverAndNotBefore) {
    EXPECT_EQ(attempt.verdict(attempt.give_up() - 1ns), Verdict::open);
    EXPECT_EQ(end(), Verdict::silent);
    EXPECT_EQ(ended, kPatience);
    EXPECT_FALSE(attempt.heard());
}

TEST_F(AttemptTest, T3TheReplyIsFoundAtAnyOffsetInAnyPieces) {
    for (const Bytes& noise : {"00"_hex, "FF"_hex, "11"_hex, "11 03"_hex, "A5 11 03 06"_hex}) {
        for (const std::size_t times : {1u, 2u, 7u}) {
            for (const std::size_t piece : {1u, 4u, 64u}) {
                again(attempt_of(kRead));
                Writer bytes;
                for (std::size_t i = 0; i < times; ++i) bytes.raw(noise);
                const Bytes all = bytes.raw(kReplyAdu).take();
                for (std::size_t at = 0; at < all.size(); at += piece)
                    hear(5ms, cut(all, at, all.size() - std::min(at + piece, all.size())));
                if (reply().empty()) end();
                EXPECT_EQ(reply(), kReplyAdu) << to_hex(noise) << ", " << times << ", " << piece;
            }
        }
    }
}

// FRM-07
TEST_F(AttemptTest, T3BytesBehindAGoodFrameAreNoPartOfIt) {
    hear(5ms, Writer().u8(0xFF).raw(kReplyAdu).u8(0).take());
    EXPECT_EQ(reply(), kReplyAdu);
    ASSERT_EQ(heard.size(), 3u);
    EXPECT_EQ(heard.back().part.bytes, "00"_hex);
}

TEST_F(AttemptTest, T3AReplyThatIsCutAtEitherEndIsDamaged) {
    for (const std::size_t missing : {1u, 2u, 3u}) {
        again(attempt_of(kRead));
        hear(5ms, cut(kReplyAdu, missing, 0));
        EXPECT_EQ(end(), Verdict::damaged) << missing;
        EXPECT_TRUE(attempt.lost_beginning());
        EXPECT_LT(ended, kPatience) << "nothing more can come";
        again(attempt_of(kRead));
        hear(5ms, cut(kReplyAdu, 0, missing));
        EXPECT_EQ(end(), Verdict::damaged) << missing;
        EXPECT_TRUE(attempt.was_cut_off());
        EXPECT_EQ(ended, kPatience) << "the reply may begin anew";
    }
}

TEST_F(AttemptTest, T3AFlippedBitAnywhereInTheReplyIsNoReply) {
    for (std::size_t at = 0; at < kReplyAdu.size(); ++at) {
        again(attempt_of(kRead));
        Bytes bad = kReplyAdu;
        bad[at] ^= 0x10;
        hear(5ms, bad);
        const Verdict verdict = end();
        EXPECT_TRUE(reply().empty());
        EXPECT_EQ(verdict, Verdict::damaged) << at;
        EXPECT_EQ(attempt.damaged_bytes(), bad);
    }
}

TEST_F(AttemptTest, T4APauseInsideTheReplyIsAHoleAndALongerOneBreaksTheReply) {
    const Duration hole = attempt.timing().hole;
    hear(10ms, cut(kReplyAdu, 0, 6));
    EXPECT_EQ(attempt.deadline() - attempt.timing().sent, 10ms + hole);
    hear(10ms + hole - 1ns, cut(kReplyAdu, 5, 0));
    EXPECT_EQ(reply(), kReplyAdu);
    EXPECT_GT(attempt.longest_pause(), hole - 10ms);
    again(attempt_of(kRead));
    hear(10ms, cut(kReplyAdu, 0, 6));
    attempt.on_silence(attempt.timing().sent + 10ms + hole);
    hear(11ms + hole, cut(kReplyAdu, 5, 0));
    EXPECT_EQ(end(), Verdict::damaged);
}

TEST_F(AttemptTest, T5AFrameOfAnotherStationIsSteppedOverAndMovesNoDeadline) {
    const Bytes other = encode_adu(18, "03 02 00 07"_hex);
    hear(5ms, other);
    attempt.on_silence(attempt.deadline());
    hear(60ms, Writer().raw(other).raw(kReplyAdu).take());
    ASSERT_EQ(heard.size(), 3u);
    EXPECT_EQ(heard[0].part.kind, Unused::Kind::foreign);
    EXPECT_TRUE(attempt.disturbed());
    EXPECT_EQ(attempt.give_up(), attempt.timing().sent + kPatience);
    EXPECT_EQ(reply(), kReplyAdu);
    EXPECT_FALSE(attempt.is_clean()) << "an echo may have been lost in it";
}

/// An adapter that switches late lets the first bytes of the request through (T6).
class APartOfTheEcho : public AttemptTest, public testing::WithParamInterface<Expect> {
  protected:
    APartOfTheEcho() { again(attempt_of(kRead, {kFrame, GetParam()})); }
};

TEST_P(APartOfTheEcho, T6TakesNoByteOfTheReplyWithIt) {
    for (std::size_t size = 1; size < kFrame.size(); ++size) {
        again(attempt_of(kRead, {kFrame, GetParam()}));
        hear(-3ms, cut(kFrame, 0, kFrame.size() - size));
        hear(5ms, cut(kReplyAdu, 0, 9));
        hear(9ms, cut(kReplyAdu, 2, 0));
        if (reply().empty()) end();
        EXPECT_EQ(reply(), kReplyAdu) << size;
        EXPECT_EQ(attempt.is_clean(), size == 1) << size;
    }
}

TEST_P(APartOfTheEcho, T6AloneIsSilenceAndNoReplyThatCameDamaged) {
    for (std::size_t size = 3; size < kFrame.size(); ++size) {
        again(attempt_of(kRead, {kFrame, GetParam()}));
        hear(0ms, cut(kFrame, 0, kFrame.size() - size));
        EXPECT_EQ(end(), Verdict::silent) << size;
    }
}

INSTANTIATE_TEST_SUITE_P(Every, APartOfTheEcho, testing::Values(Expect::nothing, Expect::perhaps));

TEST_F(AttemptTest, T6AnEchoWithoutItsFirstByteIsNoReply) {
    for (const Expect expect : {Expect::nothing, Expect::perhaps}) {
        again(attempt_of(kRead, {kFrame, expect}));
        hear(0ms, cut(kFrame, 1, 0));
        hear(5ms, kReplyAdu);
        EXPECT_EQ(reply(), kReplyAdu);
        EXPECT_FALSE(attempt.is_clean());
    }
}

}  // namespace
}  // namespace panelgate::arbiter::attempt_test
