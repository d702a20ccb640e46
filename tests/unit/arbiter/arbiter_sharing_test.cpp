// Reads that share a transaction (P6).
#include <gtest/gtest.h>

#include <vector>

#include "arbiter_fixture.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::arbiter_sharing_test {
namespace {

TEST_F(ArbiterTest, P6IdenticalReadsShareOneTransaction) {
    bus.submit(18, kRead, 99);
    std::vector<Ticket> tickets;
    for (Client client = 1; client <= 8; ++client) tickets.push_back(bus.submit(17, kRead, client));
    bus.run_to_end_of_request();
    bus.hear_reply(18, kReply);
    ASSERT_TRUE(bus.next_sent());
    bus.run_to_end_of_request();
    bus.hear_reply(17, kReply);
    for (const Ticket ticket : tickets) EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
    bus.run_for(5s);
    EXPECT_EQ(bus.sent.size(), 2u);
}

TEST_F(ArbiterTest, P6OneMayJoinWhileTheRequestLeavesButNotLater) {
    settings.paced = true;
    BusScript uart{settings};
    uart.submit(17, kRead, 1);
    uart.run_for(1ms);
    const Ticket joined = uart.submit(17, kRead, 2);
    uart.run_to_end_of_request();
    const Ticket late = uart.submit(17, kRead, 3);
    uart.run_for(3ms);
    uart.hear_reply(17, kReply);
    EXPECT_TRUE(uart.answered(joined));
    EXPECT_FALSE(uart.answered(late)) << "its value would have been sampled before it asked";
    EXPECT_TRUE(uart.next_sent());
}

TEST_F(ArbiterTest, P6NoReadJoinsWhatAFarEndMayHaveAlready) {
    bus.submit(17, kRead, 1);
    const Ticket late = bus.submit(17, kRead, 2);
    bus.hear_reply(17, kReply);
    EXPECT_FALSE(bus.answered(late)) << "the far end of a tcp line has the request at once";
}

TEST_F(ArbiterTest, P6TouchingReadsAreJoinedAndContainedOnesSliced) {
    bus.submit(18, kRead, 99);
    const Ticket a = bus.submit(17, "03 00 0A 00 02"_hex, 1);
    const Ticket b = bus.submit(17, "03 00 0C 00 01"_hex, 2);
    const Ticket c = bus.submit(17, "03 00 0B 00 01"_hex, 3);
    const Ticket apart = bus.submit(17, "03 00 0E 00 01"_hex, 4);
    bus.run_to_end_of_request();
    bus.hear_reply(18, kReply);
    ASSERT_TRUE(bus.next_sent());
    EXPECT_EQ(bus.sent.back().adu, modbus::encode_adu(17, "03 00 0A 00 03"_hex));
    bus.run_to_end_of_request();
    bus.hear_reply(17, "03 06 00 01 00 02 00 03"_hex);
    EXPECT_EQ(bus.answer(a).pdu.value(), "03 04 00 01 00 02"_hex);
    EXPECT_EQ(bus.answer(b).pdu.value(), "03 02 00 03"_hex);
    EXPECT_EQ(bus.answer(c).pdu.value(), "03 02 00 02"_hex);
    EXPECT_FALSE(bus.answered(apart));
}

TEST_F(ArbiterTest, P6BitsAreSlicedToo) {
    bus.submit(18, kRead, 99);
    const Ticket a = bus.submit(17, "01 00 03 00 0A"_hex, 1);
    const Ticket b = bus.submit(17, "01 00 0D 00 05"_hex, 2);
    bus.run_to_end_of_request();
    bus.hear_reply(18, kReply);
    ASSERT_TRUE(bus.next_sent());
    bus.run_to_end_of_request();
    bus.hear_reply(17, "01 02 CD 6B"_hex);  // bits 3..17, the sixteenth is padding
    EXPECT_EQ(bus.answer(a).pdu.value(), "01 02 CD 03"_hex);
    EXPECT_EQ(bus.answer(b).pdu.value(), "01 01 1A"_hex);
}

TEST_F(ArbiterTest, P6AJoinThatThePanelRefusesIsSplitAndRemembered) {
    bus.submit(18, kRead, 99);
    const Ticket a = bus.submit(17, "03 00 0A 00 02"_hex, 1);
    const Ticket b = bus.submit(17, "03 00 0C 00 02"_hex, 2);
    bus.run_to_end_of_request();
    bus.hear_reply(18, kReply);
    ASSERT_TRUE(bus.next_sent());
    bus.run_to_end_of_request();
    bus.hear_reply(17, "83 02"_hex);
    EXPECT_FALSE(bus.answered(a));
    for (int i = 0; i < 2; ++i) {
        ASSERT_TRUE(bus.next_sent());
        bus.run_to_end_of_request();
        const bool first_half = bus.sent.back().adu[3] == 0x0A;
        bus.hear_reply(17, first_half ? "03 04 00 01 00 02"_hex : "83 02"_hex);
    }
    EXPECT_EQ(bus.answer(a).pdu.value(), "03 04 00 01 00 02"_hex);
    EXPECT_EQ(bus.answer(b).pdu.value(), "83 02"_hex);
    bus.submit(18, kRead, 99);
    bus.submit(17, "03 00 0A 00 02"_hex, 1);
    bus.submit(17, "03 00 0C 00 02"_hex, 2);
    ASSERT_TRUE(bus.sent.back().adu[0] == 18 || bus.next_sent());
    bus.run_to_end_of_request();
    bus.hear_reply(18, kReply);
    ASSERT_TRUE(bus.next_sent());
    EXPECT_EQ(bus.sent.back().adu, modbus::encode_adu(17, "03 00 0A 00 02"_hex));
}

TEST_F(ArbiterTest, P6AClientNeverReadsOlderThanItsOwnWrite) {
    bus.submit(18, kRead, 99);
    const Ticket others = bus.submit(17, kRead, 1);
    bus.submit(17, "06 00 6B 00 07"_hex, 2, PriorityClass::write);
    const Ticket own = bus.submit(17, kRead, 2);
    bus.run_to_end_of_request();
    bus.hear_reply(18, kReply);
    ASSERT_EQ(bus.next_sent()->adu[1], 6);
    bus.run_to_end_of_request();
    bus.hear_reply(17, "06 00 6B 00 07"_hex);
    ASSERT_TRUE(bus.next_sent());
    bus.run_to_end_of_request();
    bus.hear_reply(17, kReply);
    EXPECT_TRUE(bus.answered(others));
    EXPECT_TRUE(bus.answered(own)) << "after the write it may share";
    EXPECT_EQ(bus.sent.size(), 3u);
}

}  // namespace
}  // namespace panelgate::arbiter::arbiter_sharing_test
