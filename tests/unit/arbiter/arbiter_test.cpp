// One transaction: its start, what is heard meanwhile, its end.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "arbiter_fixture.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::arbiter_test {
namespace {

using modbus::CrcOrder;
using modbus::encode_adu;

TEST_F(ArbiterTest, HandsTheReplyOnAtItsLastByte) {
    const Ticket ticket = bus.submit(17, kRead);
    ASSERT_EQ(bus.sent.size(), 1u);
    EXPECT_EQ(bus.sent[0].adu, "11 03 00 6B 00 03 76 87"_hex);
    bus.run_to_end_of_request();
    bus.run_for(3ms);
    const Bytes adu = encode_adu(17, kReply);
    bus.hear_paced(ByteView(adu).first(adu.size() - 1));
    EXPECT_FALSE(bus.answered(ticket));
    bus.hear_paced(ByteView(adu).last(1));
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
    EXPECT_EQ(bus.answer(ticket).at, bus.now());
}

TEST_F(ArbiterTest, SendsTheNextRequestExactlyAtTheLongerGapOfTheTwoStations) {
    for (const bool longer : {false, true}) {
        if (longer) settings.stations[1].frame_gap = 40ms;
        BusScript script{settings};
        script.submit(17, read_at(1), 1);
        script.submit(18, kRead, 2);
        script.submit(17, read_at(2), 1);
        for (const std::uint8_t station : Bytes{17, 18}) {
            answer(script, station, kReply);
            const TimePoint last_byte = script.now();
            EXPECT_EQ(script.next_sent().value().at - last_byte, longer ? 40ms : gap);
        }
    }
}

TEST_F(ArbiterTest, GivesUpASilentStationAfterTimeoutTimesRetriesPlusOne) {
    const Ticket ticket = bus.submit(17, kRead);
    const TimePoint start = bus.now();
    bus.run_for(5s);
    EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::timeout);
    EXPECT_EQ(bus.sent.size(), 2u);
    EXPECT_EQ(bus.answer(ticket).at - start, 2 * (kSilence + wire_time(settings.serial, 8)));
    EXPECT_EQ(counters().retries, 1u);
}

TEST_F(ArbiterTest, P5OnALineThatIsQuickerThanItsRateTheGapFollowsTheReply) {
    std::vector<Ticket> tickets;
    for (unsigned i = 0; i < 6; ++i) tickets.push_back(bus.submit(17, read_at(i)));
    std::vector<TimePoint> replied;
    for (std::size_t i = 0; i < 6; ++i) {
        ASSERT_EQ(bus.sent.size(), i + 1);
        bus.run_for(100us);  // a pty answers before the computed end of the request
        bus.hear_reply(17, reply_number(i));
        EXPECT_EQ(bus.answer(tickets[i]).pdu.value(), reply_number(i));
        replied.push_back(bus.now());
        bus.next_sent();
    }
    for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(bus.sent[i + 1].at, replied[i] + gap) << i;
}

TEST_F(ArbiterTest, ADamagedReplyIsRetriedAfterSilenceAndCounted) {
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_to_end_of_request();
    Bytes adu = encode_adu(17, kReply);
    adu[4] ^= 1;
    bus.hear(adu);
    const TimePoint damaged_at = bus.now();
    EXPECT_EQ(bus.next_sent().value().at - damaged_at, 20ms);
    EXPECT_EQ(counters().damaged_frames, 1u);
    answer(bus, 17, kReply);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
}

TEST_F(ArbiterTest, AReplyThatHasBegunInTimeIsHeardToItsEnd) {
    settings.serial.baud = 1200;
    settings.unlisted.response_timeout = 1s;
    settings.stations.clear();
    settings.queue.deadline = 10s;
    BusScript script{settings};
    const Ticket ticket = script.submit(17, "03 00 00 00 7D"_hex);
    script.run_to_end_of_request();
    script.run_for(990ms);
    Bytes pdu{0x03, 250};
    pdu.resize(252, 0x5A);
    script.hear_paced(encode_adu(17, pdu));  // 2.1 s on the wire
    EXPECT_EQ(script.answer(ticket).pdu.value(), pdu);
}

TEST_F(ArbiterTest, AReplyWithoutAKnownLengthEndsWithSilence) {
    const Ticket ticket = bus.submit(17, "41 DE AD"_hex);
    bus.run_to_end_of_request();
    bus.hear("11 41 DE AD CD 11"_hex);  // a CRC that is right in mid-frame must not end it
    EXPECT_FALSE(bus.answered(ticket));
    bus.run_for(1ms);
    bus.hear("00 11 22 33 08 B0"_hex);
    EXPECT_FALSE(bus.answered(ticket));
    bus.run_for(20ms);
    EXPECT_EQ(bus.answer(ticket).pdu.value(), "41 DE AD CD 11 00 11 22 33"_hex);
}

TEST_F(ArbiterTest, P7ALostLineAnswersEverythingAtOnce) {
    const Ticket on_wire = bus.submit(17, kRead, 1);
    const Ticket queued = bus.submit(17, kWrite, 2);
    bus.line_down();
    EXPECT_EQ(bus.answer(on_wire).pdu.error(), Fault::line_lost);
    EXPECT_TRUE(bus.answer(on_wire).transmitted);
    EXPECT_EQ(bus.answer(queued).pdu.error(), Fault::line_down);
    EXPECT_FALSE(bus.answer(queued).transmitted);
    EXPECT_EQ(bus.try_submit(17, kRead).error(), Fault::line_down);
    bus.line_up();
    bus.run_for(1100ms);
    EXPECT_EQ(bus.sent.size(), 1u) << "nothing is sent again after a lost line";
    bus.submit(17, kRead);
    EXPECT_EQ(bus.sent.size(), 2u);
}

TEST_F(ArbiterTest, EarlyAndRepeatedDeadlineCallsAreHarmless) {
    const Ticket ticket = bus.submit(17, kRead);
    for (int i = 0; i < 1000; ++i) bus.arbiter().on_deadline(bus.now());
    EXPECT_EQ(bus.sent.size(), 1u);
    bus.run_for(5s);
    EXPECT_TRUE(bus.answered(ticket));
    EXPECT_TRUE(bus.arbiter().idle());
    EXPECT_FALSE(bus.arbiter().next_deadline());
}

TEST_F(ArbiterTest, EndlessNoiseEndsInATimeoutNotInAHang) {
    const Ticket ticket = bus.submit(17, kWrite);
    bus.run_to_end_of_request();
    const Bytes noise(64, 0xA5);
    for (int i = 0; i < 1000 && !bus.answered(ticket); ++i) {
        bus.hear(noise);
        bus.run_for(5ms);
    }
    EXPECT_FALSE(bus.answer(ticket).pdu.has_value());
}

/// Panels of both CRC orders on one line: 17 has old firmware, 18 new firmware.
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
    ASSERT_EQ(line.next_sent().value().adu, encode_adu(18, kRead));
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

TEST_F(BothOrders, ABroadcastHasTheStandardsUnlessAllAreOld) {
    EXPECT_EQ(crc_orders(settings).of(0), CrcOrder::low_first);
    EXPECT_EQ(crc_orders(settings).of(17), CrcOrder::high_first);
    EXPECT_EQ(crc_orders(settings).of(99), CrcOrder::low_first);
    settings.stations[1].crc_order = CrcOrder::high_first;
    EXPECT_EQ(crc_orders(settings).of(0), CrcOrder::high_first);
    settings.stations.clear();
    EXPECT_EQ(crc_orders(settings).of(0), CrcOrder::low_first);
}

/// When a request has really left: later than computed, if switching takes time or the driver still
/// buffers bytes.
class WireEnd : public ArbiterTest {
  protected:
    WireEnd() {
        settings.unlisted.response_timeout = 100ms;
        settings.unlisted.retries = 0;
        settings.stations.clear();
    }
    /// The driver is asked, and reports once how much of the request is left.
    void report_once(BusScript& script, Duration left) {
        script.arbiter().confirm_ends(true);
        script.unsent = [this, left] {
            return std::exchange(asked, true) ? Duration::zero() : left;
        };
    }
    bool asked = false;
    Duration request = wire_time(settings.serial, 8);
};

TEST_F(WireEnd, TheTimeoutBeginsWhenTheLastBitHasLeft) {
    struct Row {
        Duration lead;
        bool confirms;
        std::vector<Duration> left;
        Duration later;
    };
    const Row rows[] = {
        {0ms, false, {7ms}, 0ms},      // as computed: such a driver is not asked
        {5ms, false, {7ms}, 5ms},      // switching to sending comes before the first bit
        {0ms, true, {7ms, 2ms}, 9ms},  // 7 ms are left, and then still 2
    };
    for (const Row& row : rows) {
        BusScript script{settings};
        script.arbiter().set_lead(row.lead);
        script.arbiter().confirm_ends(row.confirms);
        std::vector<Duration> left = row.left;
        script.unsent = [&] {
            if (left.empty()) return Duration::zero();
            const Duration first = left.front();
            left.erase(left.begin());
            return first;
        };
        const Ticket ticket = script.submit(17, kRead);
        expect_answer_at(script, ticket,
                         script.now() + request + row.later + 100ms + timing::kListensAgain);
        EXPECT_EQ(script.answer(ticket).pdu.error(), Fault::timeout);
        EXPECT_TRUE(script.answer(ticket).transmitted);
        EXPECT_EQ(left.empty(), row.confirms);
    }
}

TEST_F(WireEnd, ThinkTimeIsCountedFromThere) {
    BusScript script{settings};
    report_once(script, 20ms);
    const Ticket ticket = script.submit(17, kRead);
    script.run_for(request + 25ms);
    script.hear_reply(17, kReply);
    EXPECT_TRUE(script.answered(ticket));
    const Histogram& turnaround = script.arbiter().station_counters().at(0).turnaround;
    const Duration reply = wire_time(settings.serial, kReply.size() + 3);
    EXPECT_NEAR(turnaround.sum, to_seconds(5ms - reply - gap), 1e-9);
}

}  // namespace
}  // namespace panelgate::arbiter::arbiter_test
