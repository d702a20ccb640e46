#include "panelgate/arbiter/debt.hpp"

#include <gtest/gtest.h>

#include "support/hex.hpp"

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
    EXPECT_TRUE(debt.may_fit_reply_to("03 00 00 00 03"_hex)) << "of another place, but as long";
    EXPECT_FALSE(debt.may_fit_reply_to(kTwo));
    EXPECT_FALSE(debt.may_fit_reply_to("04 00 64 00 03"_hex));
    debt.add(at(2s), "01 00 00 00 08"_hex);
    EXPECT_TRUE(debt.may_fit_reply_to("01 00 00 00 01"_hex)) << "a byte each";
    EXPECT_FALSE(debt.may_fit_reply_to("01 00 00 00 09"_hex));
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
