#include "panelgate/arbiter/outstanding.hpp"

#include <gtest/gtest.h>

#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter {
namespace {

const Bytes kThree = "03 00 64 00 03"_hex;
const Bytes kReplyOfThree = "03 06 00 01 00 02 00 03"_hex;
const Bytes kTwo = "03 00 64 00 02"_hex;
const Bytes kReplyOfTwo = "03 04 00 01 00 02"_hex;
const Bytes kRefusal = "83 02"_hex;

TimePoint at(Duration since) { return TimePoint{} + since; }

TEST(Debt, TakesTheOldestThatAReplyMayAnswer) {
    Debt debt;
    debt.add(at(1s), kThree);
    debt.add(at(2s), kThree);
    debt.add(at(3s), kTwo);
    EXPECT_EQ(debt.take(kReplyOfTwo), kTwo);
    EXPECT_EQ(debt.oldest(kReplyOfThree)->sent, at(1s));
    EXPECT_EQ(debt.take(kReplyOfThree), kThree);
    EXPECT_EQ(debt.oldest(kReplyOfThree)->sent, at(2s));
    EXPECT_EQ(debt.take(kReplyOfTwo), Bytes{});
    EXPECT_EQ(debt.size(), 1u);
}

TEST(Debt, ARefusalMayBeOfAny) {
    Debt debt;
    debt.add(at(1s), kThree);
    debt.add(at(2s), kTwo);
    EXPECT_TRUE(debt.fits(kRefusal));
    EXPECT_EQ(debt.take(kRefusal), kThree);
}

TEST(Debt, PassesOverWhatCouldNotComeAnyMore) {
    Debt debt;
    debt.add(at(1s), kThree);
    debt.add(at(2s), kThree);
    EXPECT_EQ(debt.oldest(kReplyOfThree, at(1s))->sent, at(2s));
    EXPECT_EQ(debt.oldest(kReplyOfThree, at(5s))->sent, at(2s)) << "the last, where none could";
    EXPECT_EQ(debt.oldest(kReplyOfTwo, at(0s)), nullptr);
}

TEST(Debt, TellsWhetherAReadsReplyWouldBeItsOwn) {
    Debt debt;
    debt.add(at(1s), kThree);
    const auto ambiguous = [&](const Bytes& pdu, bool again = false) {
        return debt.is_ambiguous(test::request_of(pdu), again);
    };
    EXPECT_TRUE(ambiguous("03 00 00 00 03"_hex)) << "of another place, but as long";
    EXPECT_FALSE(ambiguous(kTwo));
    EXPECT_FALSE(ambiguous("04 00 64 00 03"_hex));
    debt.add(at(2s), "01 00 00 00 08"_hex);
    EXPECT_TRUE(ambiguous("01 00 00 00 01"_hex)) << "a byte each";
    EXPECT_FALSE(ambiguous("01 00 00 00 09"_hex));
    EXPECT_TRUE(ambiguous(kThree)) << "asked anew, its value would be too old";
    EXPECT_FALSE(ambiguous(kThree, true)) << "repeated, it is an answer";
    debt.add(at(3s), "06 00 01 00 07"_hex);
    EXPECT_FALSE(ambiguous("06 00 01 00 08"_hex)) << "the reply names the value";
    EXPECT_TRUE(ambiguous("06 00 01 00 07"_hex));
    debt.add(at(4s), "10 00 01 00 01 02 00 07"_hex);
    EXPECT_TRUE(ambiguous("10 00 01 00 01 02 00 08"_hex)) << "and that of 10 only the count";
}

TEST(Debt, StationsServeInTurn) {
    Debt debt;
    debt.add(at(1s), kThree);
    debt.add(at(3s), kTwo);
    debt.add(at(5s), kThree);
    debt.close_before(at(5s), at(2s));
    EXPECT_EQ(debt.size(), 2U);
    EXPECT_EQ(debt.oldest(kReplyOfThree)->sent, at(1s)) << "of another connection";
    EXPECT_FALSE(debt.fits(kReplyOfTwo));
    debt.close_before(at(9s), {});
    EXPECT_TRUE(debt.empty());
}

TEST(Debt, IsOnlyOfOneRequest) {
    Debt debt;
    EXPECT_FALSE(debt.is_only(kThree));
    debt.add(at(1s), kThree);
    EXPECT_TRUE(debt.is_only(kThree));
    debt.add(at(2s), kTwo);
    EXPECT_FALSE(debt.is_only(kThree));
    EXPECT_EQ(debt.last_sent(), at(2s));
}

TEST(Debt, ForgetsTheOldestOfTooMany) {
    Debt debt;
    for (std::size_t i = 0; i < Debt::kMost + 2; ++i) debt.add(at(std::chrono::seconds(i)), kThree);
    EXPECT_EQ(debt.size(), Debt::kMost);
    EXPECT_EQ(debt.oldest(kReplyOfThree)->sent, at(2s));
}

}  // namespace
}  // namespace panelgate::arbiter
