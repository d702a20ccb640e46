#include <gtest/gtest.h>

#include "support/bus_script.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::memory_test {
namespace {

using test::BusScript;

const Bytes kRead = "03 00 6B 00 03"_hex;
const Bytes kReply = "03 06 02 2B 00 00 00 64"_hex;

Settings settings_with(Duration max_age) {
    Settings settings;
    settings.serial = {38400, 8, Parity::none, 1};
    settings.unlisted.max_age = max_age;
    return settings;
}

void answer(BusScript& bus, ByteView pdu) {
    bus.run_to_end_of_request();
    bus.run_for(3ms);
    bus.hear_reply(17, pdu);
    bus.run_for(3ms);
}

TEST(Memory, P6AnswersAClientButNeverAPoll) {
    BusScript bus(settings_with(1s));
    bus.submit(17, kRead, 9, PriorityClass::poll);
    answer(bus, kReply);
    const Ticket cached = bus.submit(17, kRead, 1);
    ASSERT_TRUE(bus.answered(cached));
    EXPECT_EQ(bus.answer(cached).pdu.value(), kReply);
    EXPECT_FALSE(bus.answer(cached).transmitted);
    EXPECT_EQ(bus.sent.size(), 1u);
    bus.submit(17, kRead, 9, PriorityClass::poll);
    EXPECT_EQ(bus.sent.size(), 2u);
    answer(bus, kReply);
    bus.run_for(1s);
    bus.submit(17, kRead, 1);
    EXPECT_EQ(bus.sent.size(), 3u) << "too old";
}

TEST(Memory, IsOffUnlessTheStationAllowsIt) {
    BusScript bus(settings_with(0s));
    bus.submit(17, kRead, 9, PriorityClass::poll);
    answer(bus, kReply);
    bus.submit(17, kRead, 1);
    EXPECT_EQ(bus.sent.size(), 2u);
}

TEST(Memory, P6AClientNeverReadsOlderThanItsOwnWriteAlsoOneThatTimedOut) {
    BusScript bus(settings_with(1min));
    bus.submit(17, kRead, 9, PriorityClass::poll);
    answer(bus, kReply);
    const Ticket write = bus.submit(17, "06 00 6B 00 05"_hex, 1);
    const Ticket read = bus.submit(17, kRead, 1);
    EXPECT_FALSE(bus.answered(read)) << "its own write is still open";
    bus.run_for(490ms);  // silence; the timeout is 500 ms
    EXPECT_FALSE(bus.answered(write));
    ASSERT_TRUE(bus.next_sent(1s));
    ASSERT_TRUE(bus.answered(write));
    EXPECT_FALSE(bus.answered(read)) << "and what was known is forgotten";
    ASSERT_EQ(bus.sent.size(), 3u);
    EXPECT_EQ(bus.sent.back().adu[1], 3);
}

TEST(Memory, IsEmptyAfterTheLineWasLost) {
    BusScript bus(settings_with(1min));
    bus.submit(17, kRead, 9, PriorityClass::poll);
    answer(bus, kReply);
    bus.line_down();
    bus.line_up();
    bus.run_for(10ms);
    const Ticket read = bus.submit(17, kRead, 1);
    EXPECT_FALSE(bus.answered(read));
}

TEST(AdaptiveTimeout, OfALineAnswersTheClientEarlyAndStillWaitsForALateReply) {
    Settings settings = settings_with(0s);
    settings.unlisted.adaptive_timeout = true;
    settings.unlisted.retries = 0;
    BusScript bus(settings);
    for (int i = 0; i < 20; ++i) {
        bus.submit(17, kRead);
        answer(bus, kReply);
    }
    EXPECT_LT(bus.arbiter().response_timeout(17), Duration(40ms));
    const Ticket silent = bus.submit(17, kRead, 1);
    const TimePoint start = bus.now();
    const Ticket other = bus.submit(18, kRead, 2);
    const auto next = bus.next_sent();
    ASSERT_TRUE(next);
    EXPECT_EQ(next->adu[0], 18) << "the others need not wait for the whole timeout";
    EXPECT_LT(next->at - start, Duration(100ms));
    EXPECT_TRUE(bus.answered(silent));
    bus.run_to_end_of_request();
    bus.run_for(3ms);
    bus.hear_reply(18, kReply);
    EXPECT_TRUE(bus.answered(other));
    bus.submit(17, kRead, 1);
    EXPECT_EQ(bus.next_sent()->kind, FrameKind::probe) << "another length shows what is late";
    EXPECT_GT(bus.next_sent()->at - start, Duration(900ms)) << "where it is not answered";
}

TEST(Explain, ExplainsWhyEachRequestGoesNowAndWhyOneIsRefused) {
    Settings settings = settings_with(0s);
    settings.explain = true;
    settings.quarantine = Quarantine::line;
    settings.queue.per_client = 1;
    settings.unlisted.retries = 0;
    BusScript bus(settings);
    bus.arbiter().name_client(1, "modbus_tcp 10.0.0.5:50012");
    bus.submit(17, kRead, 1);
    bus.submit(18, kRead, 2);
    EXPECT_FALSE(bus.try_submit(18, "03 00 00 00 03"_hex, 2));
    EXPECT_EQ(text_of(bus.notes[0].why),
              "read of modbus_tcp 10.0.0.5:50012 to station 17: next in turn after 0.0 ms, 0 wait");
    ASSERT_EQ(bus.decisions.size(), 1u);
    EXPECT_EQ(
        bus.decisions[0].text,
        "read of a client without a name to station 18 refused: 1 of 256 wait on this line, at "
        "most 1 of one client");
    bus.run_for(3s);
    ASSERT_GE(bus.decisions.size(), 2u);
    EXPECT_EQ(
        bus.decisions[1].text,
        "only this request is sent for 500.0 ms: station 17 did not answer and may do so late");
}

TEST(Explain, ExplainsWhyAReadThatWasAnsweredIsAskedOnceMore) {
    Settings settings = settings_with(0s);
    settings.explain = true;
    BusScript bus(settings);
    for (const Bytes& read : {kRead, "03 01 00 00 03"_hex}) {
        bus.submit(17, read, 1);
        bus.run_to_end_of_request();
        bus.run_for(3ms);
        bus.hear_reply(17, kReply);
    }
    ASSERT_TRUE(bus.next_sent(100ms));
    ASSERT_EQ(bus.decisions.size(), 1u);
    EXPECT_EQ(bus.decisions[0].text,
              "read of a client without a name to station 17 asked once more: its answer repeats "
              "an earlier one and may be a duplicate of it");
}

TEST(Shares, P9TheTimeOfASharedTransactionIsSharedOut) {
    Settings settings = settings_with(0s);
    settings.paced = true;
    BusScript bus(settings);
    bus.submit(17, kRead, 1);
    bus.submit(17, kRead, 2);  // joins
    answer(bus, kReply);
    bus.submit(17, kRead, 3);
    answer(bus, kReply);
    const auto& shares = bus.arbiter().shares().all();
    ASSERT_EQ(shares.size(), 3u);
    EXPECT_EQ(shares.at(1).busy, shares.at(2).busy);
    EXPECT_EQ(shares.at(3).busy / 2, shares.at(1).busy);
    bus.cancel(3);
    EXPECT_EQ(bus.arbiter().shares().all().size(), 2u);
}

}  // namespace
}  // namespace panelgate::arbiter::memory_test
