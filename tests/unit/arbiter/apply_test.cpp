// New settings for a running arbiter, and another line.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>

#include "arbiter_fixture.hpp"

namespace panelgate::arbiter::apply_test {
namespace {

class ApplyTest : public ArbiterTest {
  protected:
    StationSettings& station(std::size_t index) { return settings.stations[index]; }
};

TEST_F(ApplyTest, TheNextRequestIsWaitedForAsTheNewSettingsSay) {
    station(0).response_timeout = settings.unlisted.response_timeout = 50ms;
    station(0).retries = settings.unlisted.retries = 0;
    settings.stations.pop_back();  // 18 is asked as the others
    bus.apply(settings);
    for (const std::uint8_t id : Bytes{17, 18}) {
        const Ticket asked = bus.submit(id, kRead, 1);
        bus.run_for(100ms);
        EXPECT_EQ(bus.answer(asked).pdu.error(), Fault::timeout);
    }
    EXPECT_FALSE(bus.arbiter().station_counters().contains(18));
}

TEST_F(ApplyTest, P1AShorterTimeoutEndsNoRestThatHasBegun) {
    station(0).retries = 0;
    bus.apply(settings);
    const Ticket asked = bus.submit(17, read_at(1), 1);
    bus.run_to_end_of_request();
    bus.run_for(kSilence);
    ASSERT_TRUE(bus.answered(asked));
    station(0).response_timeout = 20ms;
    bus.apply(settings);
    bus.submit(17, read_at(2), 1);
    const std::size_t sent = bus.sent.size();
    bus.run_for(400ms);
    EXPECT_EQ(bus.sent.size(), sent) << "its reply to the first may still come";
}

TEST_F(ApplyTest, P1OutstandingRepliesStayOutstandingOnAnotherWireToo) {
    bus.submit(17, read_at(1), 1);
    bus.run_to_end_of_request();
    bus.line_down();
    settings.echo = EchoMode::off;
    settings.serial.baud = 19200;
    bus.apply(settings);
    bus.line_up();
    const Ticket next = bus.submit(17, read_at(2), 2);
    bus.run_for(100ms);
    bus.hear_reply(17, kReply);  // late, of the first
    bus.run_for(10ms);
    EXPECT_FALSE(bus.answered(next));
    answer_next(bus, 17, reply_number(7));
    EXPECT_EQ(bus.answer(next).pdu.value(), reply_number(7));
}

TEST_F(ApplyTest, P3BetweenTwoLinesRequestsWaitForTheirTurn) {
    const Ticket first = bus.submit(17, read_at(1), 1);
    bus.arbiter().suspend();
    const Ticket second = bus.submit(18, read_at(2), 2);
    EXPECT_TRUE(bus.arbiter().is_waiting());
    answer(bus, 17, kReply);
    EXPECT_TRUE(bus.answered(first));
    EXPECT_FALSE(bus.next_sent(100ms));
    bus.arbiter().on_line_left();
    const Ticket third = bus.submit(17, read_at(3), 1);
    settings.serial.baud = 19200;
    settings.queue.limit = 1;  // what waits stays
    bus.apply(settings);
    EXPECT_FALSE(bus.next_sent(100ms));
    bus.line_up();
    for (const Ticket ticket : {second, third}) {
        ASSERT_TRUE(bus.next_sent());
        answer(bus, bus.sent.back().adu[0], reply_number(ticket));
        EXPECT_TRUE(bus.answered(ticket));
    }
}

TEST_F(ApplyTest, P1AWireThatAnotherMasterHasUsedRestsWhileItsRepliesAreOutstanding) {
    bus.submit(17, read_at(1), 1);
    bus.run_to_end_of_request();
    const TimePoint sent = bus.now();
    EXPECT_GE(bus.arbiter().clear_at(sent), sent + 1s) << "timeout and late window";
    bus.line_down();
    const TimePoint clear = bus.arbiter().clear_at(bus.now());
    EXPECT_GE(clear, sent + 1s);
    BusScript other{settings};
    other.line_down();
    other.arbiter().rest_until(clear);
    other.line_up();
    other.submit(18, kRead, 1);
    EXPECT_GE(other.next_sent().value().at, clear);
}

TEST(IsSameWire, OfTimesAndStationsButNotOfWhatIsOnTheWire) {
    const Settings one = settings_38400();
    Settings other = one;
    other.queue.limit = 7;
    other.unlisted.retries = 5;
    other.stations.pop_back();
    EXPECT_TRUE(is_same_wire(one, other));
    other.serial.baud = 9600;
    EXPECT_FALSE(is_same_wire(one, other));
    other = one;
    other.echo = EchoMode::on;
    EXPECT_FALSE(is_same_wire(one, other));
    other = one;
    other.stations[0].crc_order = modbus::CrcOrder::high_first;
    EXPECT_FALSE(is_same_wire(one, other));
}

}  // namespace
}  // namespace panelgate::arbiter::apply_test
