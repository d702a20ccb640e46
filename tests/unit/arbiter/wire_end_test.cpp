// When a request has really left: later than computed, if switching takes time or the driver still
// buffers bytes.
#include <gtest/gtest.h>

#include "panelgate/arbiter/arbiter.hpp"
#include "support/bus_script.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::wire_end_test {
namespace {

using test::BusScript;

const Bytes kRead = "03 00 6B 00 03"_hex;
const Bytes kReply = "03 06 02 2B 00 00 00 64"_hex;
const Bytes kWrite = "06 00 01 00 03"_hex;

class WireEnd : public testing::Test {
  protected:
    WireEnd() {
        settings.serial = {38400, 8, Parity::none, 1};
        settings.unlisted.response_timeout = 100ms;
        settings.unlisted.retries = 0;
    }
    Duration request = wire_time({38400, 8, Parity::none, 1}, 8);
    Settings settings;
};

TEST_F(WireEnd, TheTimeoutBeginsWhenTheLastBitHasLeft) {
    BusScript bus{settings};
    bus.arbiter().confirm_ends(true);
    std::vector<Duration> left{7ms, 2ms};  // 7 ms are left, and then still 2
    bus.unsent = [&] {
        if (left.empty()) return Duration::zero();
        const Duration first = left.front();
        left.erase(left.begin());
        return first;
    };
    const Ticket ticket = bus.submit(17, kRead);
    const TimePoint end = bus.now() + request + 9ms;
    bus.run_until(end + 100ms - 1us);
    EXPECT_TRUE(left.empty());
    EXPECT_FALSE(bus.answered(ticket));
    bus.run_until(end + 100ms);
    EXPECT_TRUE(bus.answered(ticket));
}

TEST_F(WireEnd, ThinkTimeIsCountedFromThere) {
    BusScript bus{settings};
    bus.arbiter().confirm_ends(true);
    bool asked = false;
    bus.unsent = [&] { return std::exchange(asked, true) ? Duration::zero() : Duration(20ms); };
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_for(request + 25ms);
    bus.hear_reply(17, kReply);
    EXPECT_TRUE(bus.answered(ticket));
    const Histogram& turnaround = bus.arbiter().station_counters().at(0).turnaround;
    const Duration reply = wire_time(settings.serial, kReply.size() + 3);
    const Duration think = 5ms - reply - silent_interval(settings.serial);
    EXPECT_NEAR(turnaround.sum, to_seconds(think), 1e-9);
}

TEST_F(WireEnd, ABroadcastsTurnaroundBeginsThereToo) {
    settings.broadcast_turnaround = 50ms;
    BusScript bus{settings};
    bus.arbiter().confirm_ends(true);
    bool asked = false;
    bus.unsent = [&] { return std::exchange(asked, true) ? Duration::zero() : Duration(30ms); };
    const TimePoint start = bus.now();
    const Ticket broadcast = bus.submit(0, kWrite, 1, PriorityClass::write);
    bus.submit(17, kRead, 2);
    bus.run_for(request + 29ms);
    EXPECT_FALSE(bus.answered(broadcast));
    const auto next = bus.next_sent();
    ASSERT_TRUE(next);
    EXPECT_TRUE(bus.answered(broadcast));
    EXPECT_EQ(next->at - start, request + 30ms + 50ms);
}

TEST_F(WireEnd, ADriverThatNeverGetsRidOfItIsNotBelievedForLong) {
    BusScript bus{settings};
    bus.arbiter().confirm_ends(true);
    bus.unsent = [] { return Duration(10ms); };
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_for(request + 1s + 100ms);
    EXPECT_TRUE(bus.answered(ticket));
}

TEST_F(WireEnd, SwitchingToSendingComesBeforeTheFirstBit) {
    BusScript bus{settings};
    bus.arbiter().set_lead(5ms);
    const Ticket ticket = bus.submit(17, kRead);
    const TimePoint end = bus.now() + 5ms + request;
    bus.run_until(end + 100ms - 1us);
    EXPECT_FALSE(bus.answered(ticket));
    bus.run_until(end + 100ms);
    EXPECT_TRUE(bus.answered(ticket));
}

TEST_F(WireEnd, ALineThatCannotReportTheEndIsNotAsked) {
    BusScript bus{settings};
    bool asked = false;
    bus.unsent = [&] {
        asked = true;
        return Duration::zero();
    };
    bus.submit(17, kRead);
    bus.run_for(1s);
    EXPECT_FALSE(asked);
}

}  // namespace
}  // namespace panelgate::arbiter::wire_end_test
