// Writes, broadcasts and deadlines (P2, P3): nothing is sent twice, or without a client.
#include <gtest/gtest.h>

#include "arbiter_fixture.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::arbiter_writes_test {
namespace {

TEST_F(ArbiterTest, P2NeverRepeatsAWriteUnlessTheStationAllowsIt) {
    for (const Bytes& write :
         {kWrite, "05 00 01 FF 00"_hex, "10 00 01 00 01 02 00 03"_hex, "0F 00 01 00 01 01 01"_hex,
          "16 00 04 00 F2 00 25"_hex, "17 00 03 00 01 00 0E 00 01 02 00 FF"_hex, "41 01 02"_hex}) {
        BusScript script{settings};
        const Ticket ticket = script.submit(17, write);
        script.run_for(5s);
        EXPECT_EQ(script.sent.size(), 1u) << to_hex(write);
        EXPECT_EQ(script.answer(ticket).pdu.error(), Fault::timeout);
        EXPECT_TRUE(script.answer(ticket).transmitted);
    }
    settings.stations[0].retry_writes = true;
    BusScript script{settings};
    script.submit(17, kWrite);
    script.run_for(5s);
    EXPECT_EQ(script.sent.size(), 2u);
}

TEST_F(ArbiterTest, P6ReportsWhatAWriteTouchesWhenItLeavesAndWhenItsAttemptIsOver) {
    bus.submit(17, kRead);
    answer(bus, 17, kReply);
    EXPECT_TRUE(bus.written.empty()) << "a read";
    bus.submit(17, kToAll);
    ASSERT_TRUE(bus.next_sent());
    ASSERT_EQ(bus.written.size(), 1u);
    EXPECT_EQ(bus.written[0].station, 17);
    EXPECT_EQ(bus.written[0].items, (modbus::Span{modbus::Table::holding_registers, 100, 2}));
    EXPECT_FALSE(bus.written[0].ended);
    bus.run_for(5s);
    ASSERT_EQ(bus.written.size(), 2u) << "nobody answered";
    EXPECT_TRUE(bus.written[1].ended);
    bus.submit(0, kWrite);
    bus.run_for(1s);
    ASSERT_EQ(bus.written.size(), 4u);
    EXPECT_EQ(bus.written[3].station, 0);
    bus.submit(17, "41 01 02"_hex);
    bus.run_for(5s);
    EXPECT_FALSE(bus.written.back().items) << "nobody knows what it does";
}

TEST_F(ArbiterTest, ABroadcastIsAnsweredWhenItHasLeftAndTheLineRestsForTheTurnaround) {
    struct Row {
        Bytes pdu;
        Bytes confirmed;
    };
    const Row rows[] = {
        {kWrite, kWrite}, {kToAll, kConfirmed},  // several items: address and quantity
    };
    for (const Row& row : rows) {
        BusScript script{settings};
        const Ticket broadcast = script.submit(0, row.pdu, 1, PriorityClass::write);
        script.submit(17, kRead, 2);
        script.run_to_end_of_request();
        EXPECT_EQ(script.answer(broadcast).pdu.value(), row.confirmed);
        const TimePoint end = script.now();
        EXPECT_EQ(script.next_sent().value().at - end, 100ms);
        EXPECT_EQ(script.arbiter().counters().broadcasts, 1u);
    }
}

TEST_F(ArbiterTest, P3ExpiresWhatCannotFinishBeforeItsDeadlineWithoutTouchingTheWire) {
    settings.queue.deadline = 400ms;
    BusScript script{settings};
    const Ticket first = script.submit(17, kRead, 1);
    const Ticket second = script.submit(18, kRead, 2);
    const TimePoint start = script.now();
    script.run_for(1s);
    // The first read is cut at its deadline, the second read was never started.
    EXPECT_EQ(script.answer(first).pdu.error(), Fault::timeout);
    EXPECT_EQ(script.answer(first).at - start, 400ms);
    EXPECT_EQ(script.answer(second).pdu.error(), Fault::expired);
    EXPECT_FALSE(script.answer(second).transmitted);
    EXPECT_LT(script.answer(second).at - start, 400ms);
    EXPECT_EQ(script.sent.size(), 1u);
}

TEST_F(ArbiterTest, P2ACancelledClientsQueueNeverReachesTheWire) {
    const Ticket on_wire = bus.submit(17, kRead, 1);
    const Ticket queued = bus.submit(17, kWrite, 1);
    bus.cancel(1);
    EXPECT_EQ(bus.answer(queued).pdu.error(), Fault::cancelled);
    EXPECT_FALSE(bus.answer(queued).transmitted);
    answer(bus, 17, kReply);
    EXPECT_EQ(bus.answer(on_wire).pdu.value(), kReply);
    bus.run_for(5s);
    EXPECT_EQ(bus.sent.size(), 1u);
}

}  // namespace
}  // namespace panelgate::arbiter::arbiter_writes_test
