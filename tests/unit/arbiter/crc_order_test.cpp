// Panels of both CRC orders on one line.
#include <gtest/gtest.h>

#include "arbiter_fixture.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::crc_order_test {
namespace {

using modbus::CrcOrder;
using modbus::encode_adu;

/// 17 has old firmware, 18 has not.
class BothOrders : public ArbiterTest {
  protected:
    BothOrders() {
        settings.stations[0].crc_order = CrcOrder::high_first;
        settings.stations[0].retries = 0;
    }
    BusScript script() const { return BusScript{settings}; }
    static Bytes old_adu(const Bytes& pdu) { return encode_adu(17, pdu, CrcOrder::high_first); }
};

TEST_F(BothOrders, EachPanelIsAskedAndUnderstoodInItsOwn) {
    BusScript line = script();
    const Ticket old_one = line.submit(17, kRead, 1);
    EXPECT_EQ(line.sent.back().adu, old_adu(kRead));
    line.run_to_end_of_request();
    line.hear(old_adu(kReply));
    EXPECT_EQ(line.answer(old_one).pdu.value(), kReply);
    const Ticket new_one = line.submit(18, kRead, 1);
    ASSERT_EQ(line.next_sent()->adu, encode_adu(18, kRead));
    line.run_to_end_of_request();
    line.hear(encode_adu(18, kReply));
    EXPECT_EQ(line.answer(new_one).pdu.value(), kReply);
}

TEST_F(BothOrders, P1TheOtherOrderIsNoReply) {
    BusScript line = script();
    const Ticket ticket = line.submit(17, kRead, 1);
    line.run_to_end_of_request();
    line.hear(encode_adu(17, kReply));
    line.run_for(2s);
    EXPECT_EQ(line.answer(ticket).pdu.error(), Fault::damaged);
    EXPECT_EQ(line.arbiter().station_counters().at(17).symptoms.crc_swapped, 1u);
}

TEST_F(BothOrders, P1ALateReplyOfTheOtherKindIsKnownAndAnswersNoRequest) {
    BusScript line = script();
    const Ticket silent = line.submit(17, read_at(1), 1);
    const Ticket other = line.submit(18, read_at(2), 2);
    while (!line.answered(silent)) line.run_for(1ms);
    while (line.sent.back().adu[0] != 18) line.run_for(1ms);
    line.run_to_end_of_request();
    line.hear(old_adu(reply_number(1)));
    EXPECT_FALSE(line.answered(other));
    line.hear(encode_adu(18, reply_number(2)));
    EXPECT_EQ(line.answer(other).pdu.value(), reply_number(2));
    ASSERT_FALSE(line.events.empty());
    EXPECT_EQ(line.events.back().kind, StationEvent::Kind::late);
    EXPECT_EQ(line.arbiter().station_counters().at(17).late_frames, 1u);
}

TEST_F(BothOrders, P8AnEchoIsOurOwnFrameInWhicheverOrder) {
    settings.echo = EchoMode::on;
    BusScript line = script();
    const Ticket ticket = line.submit(17, kWrite, 1);
    line.run_to_end_of_request();
    line.hear(old_adu(kWrite));
    EXPECT_FALSE(line.answered(ticket));
    line.hear(old_adu(kWrite));
    EXPECT_EQ(line.answer(ticket).pdu.value(), kWrite);
}

TEST_F(BothOrders, ABroadcastHasTheStandardsUnlessAllAreOld) {
    EXPECT_EQ(crc_orders(settings).of(0), CrcOrder::low_first);
    EXPECT_EQ(crc_orders(settings).of(17), CrcOrder::high_first);
    EXPECT_EQ(crc_orders(settings).of(99), CrcOrder::low_first);
    settings.stations[1].crc_order = CrcOrder::high_first;
    EXPECT_EQ(crc_orders(settings).of(0), CrcOrder::high_first);
    settings.stations.clear();
    EXPECT_EQ(crc_orders(settings).of(0), CrcOrder::low_first);
}

}  // namespace
}  // namespace panelgate::arbiter::crc_order_test
