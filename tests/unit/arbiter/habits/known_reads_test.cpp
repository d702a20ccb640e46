#include "panelgate/arbiter/habits/known_reads.hpp"

#include <gtest/gtest.h>

#include <cstdint>

namespace panelgate::arbiter::known_reads_test {
namespace {

using modbus::Request;
using modbus::Span;
using modbus::Table;

Span holding(std::uint32_t first, std::uint32_t count) {
    return {Table::holding_registers, first, count};
}

void answer(LearnedReads& reads, const Span& span) { reads.on_answered(Request::read(span), span); }

TEST(LearnedReads, BeforeAnyAnswerTheProbeIsWhatAClientWantedLast) {
    LearnedReads reads;
    EXPECT_EQ(reads.probe().pdu(), Request::read(holding(0, 1)).pdu());
    reads.on_wanted(Request::read(holding(7, 4)));
    EXPECT_FALSE(reads.any());
    EXPECT_EQ(reads.probe().pdu(), Request::read(holding(7, 4)).pdu());
    EXPECT_EQ(reads.largest(), holding(7, 4));
}

TEST(LearnedReads, TheProbeIsTheCheapestThatWasAnsweredAndItsPartsComeOfTheLargest) {
    LearnedReads reads;
    answer(reads, holding(100, 10));
    answer(reads, holding(300, 2));
    answer(reads, holding(200, 60));
    reads.on_wanted(Request::read(holding(0, 1)));
    EXPECT_EQ(reads.probe().pdu(), Request::read(holding(300, 2)).pdu());
    EXPECT_EQ(reads.largest(), holding(200, 60));
    EXPECT_EQ(reads.longest(Table::holding_registers), 60u);
    EXPECT_EQ(reads.longest(Table::input_registers), 0u);
}

TEST(ReconnectState, HasAnsweredOnlyIfAReplyCameSinceTheLineWasOpenedAndNothingIsOutstandingAnew) {
    ReconnectState state;
    state.on_replied(true);
    EXPECT_FALSE(state.answered()) << "it was never opened anew";
    state.on_opened();
    EXPECT_FALSE(state.answered());
    state.on_replied(true);
    EXPECT_TRUE(state.answered());
    state.on_outstanding();
    EXPECT_FALSE(state.answered());
}

TEST(ReconnectState, AReadOfAnotherLengthThatWasNotAnsweredIsNotTriedAgainBefore16QuickReplies) {
    ReconnectState state;
    state.on_probe_unanswered(true);
    for (int i = 0; i < 15; ++i) state.on_replied(true);
    state.on_replied(false);  // a slow one says nothing
    EXPECT_TRUE(state.only_known_reads());
    state.on_replied(true);
    EXPECT_FALSE(state.only_known_reads());
    state.on_probe_unanswered(false);
    EXPECT_FALSE(state.only_known_reads()) << "a usual read";
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
}  // namespace panelgate::arbiter::known_reads_test
