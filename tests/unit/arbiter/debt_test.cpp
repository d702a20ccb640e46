#include "panelgate/arbiter/outstanding.hpp"

#include <gtest/gtest.h>

#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::debt_test {
namespace {

const Bytes kThree = "03 00 64 00 03"_hex;
const Bytes kReplyOfThree = "03 06 00 01 00 02 00 03"_hex;
const Bytes kTwo = "03 00 64 00 02"_hex;
const Bytes kReplyOfTwo = "03 04 00 01 00 02"_hex;
const Bytes kRefusal = "83 02"_hex;

TimePoint at(Duration since) { return TimePoint{} + since; }

TEST(OutstandingReplies, TakesTheOldestThatAReplyMayAnswer) {
    OutstandingReplies outstanding;
    outstanding.add(at(1s), kThree);
    outstanding.add(at(2s), kThree);
    outstanding.add(at(3s), kTwo);
    EXPECT_EQ(outstanding.take(kReplyOfTwo), kTwo);
    EXPECT_EQ(outstanding.oldest(kReplyOfThree)->sent, at(1s));
    EXPECT_EQ(outstanding.take(kReplyOfThree), kThree);
    EXPECT_EQ(outstanding.oldest(kReplyOfThree)->sent, at(2s));
    EXPECT_EQ(outstanding.take(kReplyOfTwo), Bytes{});
    EXPECT_EQ(outstanding.size(), 1u);
}

TEST(OutstandingReplies, ARefusalMayBeOfAny) {
    OutstandingReplies outstanding;
    outstanding.add(at(1s), kThree);
    outstanding.add(at(2s), kTwo);
    EXPECT_TRUE(outstanding.fits(kRefusal));
    EXPECT_EQ(outstanding.take(kRefusal), kThree);
}

TEST(OutstandingReplies, PassesOverWhatCouldNotComeAnyMore) {
    OutstandingReplies outstanding;
    outstanding.add(at(1s), kThree);
    outstanding.add(at(2s), kThree);
    EXPECT_EQ(outstanding.oldest(kReplyOfThree, at(1s))->sent, at(2s));
    EXPECT_EQ(outstanding.oldest(kReplyOfThree, at(5s))->sent, at(2s))
        << "the last, where none could";
    EXPECT_EQ(outstanding.oldest(kReplyOfTwo, at(0s)), nullptr);
}

TEST(OutstandingReplies, KnowsWhetherAReadsReplyWouldBeItsOwn) {
    OutstandingReplies outstanding;
    outstanding.add(at(1s), kThree);
    const auto ambiguous = [&](const Bytes& pdu, bool again = false) {
        return outstanding.is_ambiguous(test::request_of(pdu), again);
    };
    EXPECT_TRUE(ambiguous("03 00 00 00 03"_hex)) << "of another place, but as long";
    EXPECT_FALSE(ambiguous(kTwo));
    EXPECT_FALSE(ambiguous("04 00 64 00 03"_hex));
    outstanding.add(at(2s), "01 00 00 00 08"_hex);
    EXPECT_TRUE(ambiguous("01 00 00 00 01"_hex)) << "a byte each";
    EXPECT_FALSE(ambiguous("01 00 00 00 09"_hex));
    EXPECT_TRUE(ambiguous(kThree)) << "asked anew, its value would be too old";
    EXPECT_FALSE(ambiguous(kThree, true)) << "repeated, it is an answer";
    outstanding.add(at(3s), "06 00 01 00 07"_hex);
    EXPECT_FALSE(ambiguous("06 00 01 00 08"_hex)) << "the reply names the value";
    EXPECT_TRUE(ambiguous("06 00 01 00 07"_hex));
    outstanding.add(at(4s), "10 00 01 00 01 02 00 07"_hex);
    EXPECT_TRUE(ambiguous("10 00 01 00 01 02 00 08"_hex)) << "and that of 10 only the count";
}

TEST(OutstandingReplies, StationsServeInTurn) {
    OutstandingReplies outstanding;
    outstanding.add(at(1s), kThree);
    outstanding.add(at(3s), kTwo);
    outstanding.add(at(5s), kThree);
    outstanding.close_before(at(5s), at(2s));
    EXPECT_EQ(outstanding.size(), 2U);
    EXPECT_EQ(outstanding.oldest(kReplyOfThree)->sent, at(1s)) << "of another connection";
    EXPECT_FALSE(outstanding.fits(kReplyOfTwo));
    outstanding.close_before(at(9s), {});
    EXPECT_TRUE(outstanding.empty());
}

TEST(OutstandingReplies, IsOnlyOfOneRequest) {
    OutstandingReplies outstanding;
    EXPECT_FALSE(outstanding.is_only(kThree));
    outstanding.add(at(1s), kThree);
    EXPECT_TRUE(outstanding.is_only(kThree));
    outstanding.add(at(2s), kTwo);
    EXPECT_FALSE(outstanding.is_only(kThree));
    EXPECT_EQ(outstanding.last_sent(), at(2s));
}

TEST(OutstandingReplies, ForgetsTheOldestOfTooMany) {
    OutstandingReplies outstanding;
    for (std::size_t i = 0; i < OutstandingReplies::kMost + 2; ++i)
        outstanding.add(at(std::chrono::seconds(i)), kThree);
    EXPECT_EQ(outstanding.size(), OutstandingReplies::kMost);
    EXPECT_EQ(outstanding.oldest(kReplyOfThree)->sent, at(2s));
}

TEST(ReconnectState, P4TriesAnotherLengthAgainAfterSixteenReplies) {
    ReconnectState state;
    state.on_probe_unanswered(true);
    for (int i = 0; i < 99; ++i) state.on_replied(false);
    for (int i = 0; i < 15; ++i) {
        state.on_replied(true);
        EXPECT_TRUE(state.only_known_reads()) << i;
    }
    state.on_replied(true);
    EXPECT_FALSE(state.only_known_reads()) << "it may just have been lost";
    state.on_probe_unanswered(true);
    state.on_replied(true);
    EXPECT_TRUE(state.only_known_reads());
}

}  // namespace
}  // namespace panelgate::arbiter::debt_test
