// The memory of the line's past: requests whose reply may still come, and the last reply (T2).
#include "panelgate/arbiter/outstanding.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <cstdint>

#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::outstanding_test {
namespace {

using By = Asked::By;
using modbus::Request;
using modbus::Table;
using test::request_of;

constexpr std::uint8_t kId = 17;
const Bytes kThree = "03 00 64 00 03"_hex;
const Bytes kThreeElsewhere = "03 00 00 00 03"_hex;
const Bytes kReplyOfThree = "03 06 00 01 00 02 00 03"_hex;
const Bytes kTwo = "03 00 64 00 02"_hex;
const Bytes kReplyOfTwo = "03 04 00 01 00 02"_hex;
const Bytes kWrite = "06 00 01 00 07"_hex;
const Bytes kRefusal = "83 02"_hex;

TimePoint at(Duration since) { return TimePoint{1h} + since; }

class OutstandingTest : public testing::Test {
  protected:
    /// A request that left then was not answered; its reply may come for `window`.
    void add(Duration sent, const Bytes& pdu, Duration window = 10s, By by = By::us) {
        memory.add(kId, asked(sent, pdu, window, by));
    }
    static Asked asked(Duration sent, const Bytes& pdu, Duration window = 10s, By by = By::us) {
        return {.by = by, .sent = at(sent), .until = at(sent + window), .pdu = pdu};
    }
    bool fits(const Bytes& reply, Duration now = 5s, By by = By::us) const {
        return memory.answered_by(at(now), kId, reply, by) != nullptr;
    }
    TimePoint oldest(const Bytes& reply) const {
        return memory.answered_by(at(5s), kId, reply)->sent;
    }
    TimePoint clear(const Bytes& request, bool again = false) const {
        return memory.clear_at(at(5s), kId, request_of(request), again);
    }
    bool is_proof(const Bytes& read, bool again = false) const {
        return memory.is_proof(at(5s), kId, request_of(read), again);
    }

    Outstanding memory;
};

// May this frame be the reply?

TEST_F(OutstandingTest, AReplyMayAnswerTheOldestRequestOfItsForm) {
    add(1s, kThree);
    add(2s, kThreeElsewhere);
    add(3s, kTwo);
    EXPECT_EQ(oldest(kReplyOfThree), at(1s));
    EXPECT_EQ(oldest(kReplyOfTwo), at(3s));
    EXPECT_EQ(oldest(kRefusal), at(1s)) << "an exception may answer any request of its function";
    EXPECT_FALSE(fits("04 02 00 01"_hex));
    EXPECT_FALSE(memory.answered_by(at(5s), kId + 1, kReplyOfThree));
}

TEST_F(OutstandingTest, AReplyComesNoLaterThanItsWindowTells) {
    add(1s, kThree, 2s);
    EXPECT_TRUE(fits(kReplyOfThree, 3s - 1ns));
    EXPECT_FALSE(fits(kReplyOfThree, 3s));
    EXPECT_TRUE(memory.any(at(3s) - 1ns, kId));
    EXPECT_FALSE(memory.any(at(3s), kId));
}

TEST_F(OutstandingTest, T14WhereAnyByteCountMayComeTheReplysOwnDecides) {
    Asked odd = asked(1s, kTwo);
    odd.byte_count = modbus::ByteCount::any;
    memory.add(kId, odd);
    EXPECT_TRUE(fits("03 08 00 01 00 02 00 03 00 04"_hex));
    EXPECT_FALSE(fits("03 08 00 01"_hex));
    EXPECT_FALSE(is_proof(kThree)) << "no length tells the replies apart";
    EXPECT_TRUE(is_proof("04 00 00 00 01"_hex));
}

TEST_F(OutstandingTest, T12TheLastReplyIsKnownForAsLongAsAsked) {
    memory.on_reply(at(1s), kId, asked(0s, kTwo), kReplyOfTwo);
    EXPECT_TRUE(memory.is_last_reply(at(1100ms), kId, kReplyOfTwo, 100ms));
    EXPECT_FALSE(memory.is_last_reply(at(1101ms), kId, kReplyOfTwo, 100ms));
    const Bytes other_values = "03 04 00 09 00 09"_hex;
    EXPECT_FALSE(memory.is_last_reply(at(1s), kId, other_values, 100ms));
    EXPECT_TRUE(memory.has_last_form(at(1s), kId, other_values, 100ms));
    EXPECT_FALSE(memory.has_last_form(at(1s), kId, kReplyOfThree, 100ms));
    EXPECT_FALSE(memory.has_last_form(at(1s), kId + 1, kReplyOfTwo, 100ms));
}

// Could a reply be taken for the reply to a new request?

TEST_F(OutstandingTest, P1ARequestOfTheSameFunctionWaitsUntilNoReplyOrExceptionCanCome) {
    add(1s, kThree);
    add(2s, kTwo);
    EXPECT_EQ(clear(kThree), at(12s));
    EXPECT_EQ(clear("03 00 00 00 09"_hex), at(12s)) << "an exception names its function alone";
    EXPECT_LE(clear("04 00 00 00 03"_hex), at(5s));
    EXPECT_LE(clear(kWrite), at(5s));
}

TEST_F(OutstandingTest, P1ARetryIsAnsweredByTheReplyToItsOwnEarlierAttempt) {
    add(1s, kThree);
    EXPECT_EQ(clear(kThree), at(11s)) << "a new request would have too old a value";
    EXPECT_LE(clear(kThree, true), at(5s));
    add(2s, kThreeElsewhere);
    EXPECT_EQ(clear(kThree, true), at(12s));
}

TEST_F(OutstandingTest, T2AReadOfAnotherLengthThanEachOutstandingReplyIsAProof) {
    EXPECT_TRUE(is_proof(kThree)) << "nothing is outstanding";
    add(1s, kThree);
    EXPECT_FALSE(is_proof(kThreeElsewhere));
    EXPECT_TRUE(is_proof(kTwo));
    EXPECT_FALSE(is_proof(kThree));
    EXPECT_TRUE(is_proof(kThree, true));
    add(2s, "11"_hex);
    EXPECT_TRUE(is_proof(kTwo)) << "another function";
    add(3s, kTwo);
    EXPECT_FALSE(is_proof(kTwo));
    EXPECT_EQ(memory.last_read(at(5s), kId)->pdu, kTwo);
}

TEST_F(OutstandingTest, T11ABroadcastHoldsOnlyTheWriteThatItsReplyWouldConfirm) {
    const Bytes to_all = "10 00 64 00 02 04 00 0A 01 02"_hex;
    memory.add(kId, asked(1s, to_all, 10s, By::broadcast));
    EXPECT_EQ(clear("10 00 64 00 02 04 00 00 00 00"_hex), at(11s));
    EXPECT_LE(clear("10 00 68 00 02 04 00 00 00 00"_hex), at(5s));
    EXPECT_LE(clear(kTwo), at(5s));
    EXPECT_TRUE(fits("10 00 64 00 02"_hex, 5s, By::broadcast));
    EXPECT_FALSE(fits("10 00 64 00 02"_hex)) << "no request to this station alone";
    EXPECT_FALSE(memory.any(at(5s), kId));
}

// Closing

TEST_F(OutstandingTest, P1TheReplyToALaterRequestClosesTheEarlierOnes) {
    add(1s, kThree);
    add(2s, kThreeElsewhere);
    EXPECT_TRUE(memory.on_reply(at(4s), kId, asked(3s, kTwo), kReplyOfTwo));
    EXPECT_FALSE(memory.any(at(5s), kId));
}

TEST_F(OutstandingTest, P1BehindTwoEqualRequestsOneReplyIsStillToCome) {
    add(1s, kTwo);
    EXPECT_FALSE(memory.on_reply(at(4s), kId, asked(3s, kTwo), kReplyOfTwo));
    EXPECT_EQ(oldest(kReplyOfTwo), at(3s)) << "the first request has had its reply";
}

TEST_F(OutstandingTest, P1ALateReplyClosesItsRequestAndThoseBefore) {
    add(1s, kThree);
    add(2s, kTwo);
    add(3s, kThreeElsewhere);
    EXPECT_EQ(memory.on_late(at(5s), kId, kReplyOfTwo, false)->sent, at(2s));
    EXPECT_EQ(oldest(kReplyOfThree), at(3s));
    EXPECT_TRUE(memory.is_last_reply(at(5s), kId, kReplyOfTwo, 1ms));
    EXPECT_FALSE(memory.on_late(at(5s), kId, kReplyOfTwo, false));
}

TEST_F(OutstandingTest, P1T8OverTwoConnectionsTheOrderIsUnknown) {
    add(1s, kThree);
    memory.on_opened();
    add(2s, kTwo);
    memory.on_reply(at(4s), kId, asked(3s, kWrite), kWrite);
    EXPECT_EQ(oldest(kReplyOfThree), at(1s)) << "asked over the connection before";
    EXPECT_FALSE(fits(kReplyOfTwo));
    EXPECT_EQ(memory.clear_at(at(5s), kId, request_of(kTwo), false, true), at(11s));
    EXPECT_EQ(memory.clear_at(at(5s), kId, request_of(kWrite), false, true), TimePoint{});
    add(4s, kThree);
    memory.on_late(at(5s), kId, kReplyOfThree, false);
    EXPECT_EQ(oldest(kReplyOfThree), at(1s)) << "a reply of either connection closes neither";
}

TEST_F(OutstandingTest, P1T8WhatMayBeInTransitIsOutstandingUntilALaterRequestWasAnswered) {
    Asked stalled = asked(1s, kThree);
    stalled.until = Outstanding::kInTransit;
    stalled.window = 2s;
    memory.add(kId, stalled);
    EXPECT_TRUE(memory.any(at(24h), kId));
    EXPECT_EQ(memory.all_clear_at(at(5s), 2s), at(7s));
    memory.on_delivered(at(5s), at(1s));
    EXPECT_TRUE(memory.any(at(24h), kId)) << "the answered request had not left later";
    memory.on_delivered(at(5s), at(4s));
    EXPECT_FALSE(memory.any(at(24h), kId));
    EXPECT_EQ(clear(kThree), at(7s));
}

/// The replies of a quick station once ended the late window of a slow station.
TEST_F(OutstandingTest, P1T2AReplyOfAnotherStationEndsNoLateWindow) {
    add(1s, kThree);
    memory.on_delivered(at(5s), at(4s));
    EXPECT_EQ(clear(kThree), at(11s));
}

/// A late reply answers the client; the retry is refused 05 or 06, and the real reply follows.
TEST_F(OutstandingTest, P1T10WhatIsRefusedBusyStaysOutstandingAlsoBehindALateReply) {
    for (const Bytes& busy : {"83 05"_hex, "83 06"_hex}) {
        Asked retry = asked(2s, kThree);
        retry.window = 5s;
        memory.add(kId, retry);
        memory.on_late(at(3s), kId, busy, false);
        EXPECT_EQ(clear(kThree), at(12s));
        memory.on_late(at(4s), kId, kReplyOfThree, false);
        EXPECT_EQ(clear(kThree), TimePoint{});
    }
}

// Other masters (T9), and limits

TEST_F(OutstandingTest, T9AnotherMastersRequestHoldsNoneOfOursAndHasOneReply) {
    add(1s, kTwo, 10s, By::other_master);
    EXPECT_FALSE(memory.any(at(5s), kId));
    EXPECT_LE(clear(kTwo), at(5s));
    EXPECT_TRUE(fits(kReplyOfTwo, 5s, By::other_master));
    memory.on_reply(at(4s), kId, asked(3s, kThree), kReplyOfThree);
    EXPECT_TRUE(fits(kReplyOfTwo, 5s, By::other_master)) << "our reply closes our requests alone";
    memory.on_other_answered(at(5s), kId, kReplyOfTwo);
    EXPECT_FALSE(fits(kReplyOfTwo, 5s, By::other_master));
    add(1s, kTwo, 10s, By::other_master);
    memory.forget_other_masters();
    EXPECT_FALSE(fits(kReplyOfTwo, 5s, By::other_master));
}

TEST_F(OutstandingTest, OfTooManyTheOldestOfItsKindIsForgotten) {
    for (std::size_t i = 0; i < Outstanding::kMostOthers + 1; ++i)
        add(i * 1ms, "01 00 00 00 01"_hex, 1h, By::other_master);
    for (std::size_t i = 0; i < Outstanding::kMost + 2; ++i) add(i * 1ms, kThree, 1h);
    EXPECT_EQ(oldest(kReplyOfThree), at(2ms));
    const Asked* const other = memory.answered_by(at(5s), kId, "01 01 01"_hex, By::other_master);
    EXPECT_EQ(other->sent, at(1ms));
    memory.forget(kId);
    EXPECT_FALSE(memory.any(at(5s), kId));
}

// Reads that a station is known to answer

class KnownReadsTest : public testing::Test {
  protected:
    static Request holding(std::uint32_t first, std::uint32_t count) {
        return Request::read({Table::holding_registers, first, count});
    }
    KnownReads reads;
};

TEST_F(KnownReadsTest, BeforeAnyAnswerTheProbeIsTheReadThatAClientWantedLast) {
    EXPECT_EQ(reads.probe(), holding(0, 1));
    reads.on_wanted(holding(7, 4));
    reads.on_wanted(request_of(kWrite));
    EXPECT_FALSE(reads.any());
    EXPECT_EQ(reads.probe(), holding(7, 4));
    EXPECT_FALSE(reads.longest());
}

TEST_F(KnownReadsTest, TheProbeIsTheShortestReadThatWasAnswered) {
    for (const Request& read : {holding(100, 10), holding(300, 2), holding(200, 60)})
        reads.on_answered(read);
    reads.on_wanted(holding(0, 1));
    EXPECT_EQ(reads.probe(), holding(300, 2));
    EXPECT_EQ(reads.longest(), holding(200, 60));
    EXPECT_EQ(reads.longest(Table::holding_registers), 60u);
    EXPECT_EQ(reads.longest(Table::input_registers), 0u);
}

TEST_F(KnownReadsTest, T14AReadLongerByOneItemIsTriedUntilThePanelDoesNotAnswerOne) {
    EXPECT_FALSE(reads.longer());
    reads.on_answered(holding(200, 60));
    EXPECT_EQ(reads.longer(), holding(200, 61));
    reads.on_unanswered(holding(200, 60));
    EXPECT_TRUE(reads.longer());
    reads.on_unanswered(holding(200, 61));
    EXPECT_FALSE(reads.longer());
}

}  // namespace
}  // namespace panelgate::arbiter::outstanding_test
