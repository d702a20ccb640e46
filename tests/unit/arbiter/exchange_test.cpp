// What is reported of each transaction: its number, its instants, and how it ended.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "arbiter_fixture.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::arbiter::exchange_test {
namespace {

class ExchangeTest : public testing::Test {
  protected:
    ExchangeTest() {
        settings.explain = true;
        settings.paced = true;
    }
    /// Asks 17; its reply comes byte by byte after 5 ms.
    void answer_one(BusScript& bus) {
        bus.submit(17, kRead);
        bus.run_to_end_of_request();
        bus.run_for(5ms);
        bus.hear_paced(modbus::encode_adu(17, kReply));
        bus.run_for(20ms);
    }
    static std::vector<std::string> ends(const BusScript& bus) {
        std::vector<std::string> words;
        for (const Exchange& one : bus.exchanges) words.emplace_back(label(one.end));
        return words;
    }

    Settings settings = settings_38400();
};

TEST_F(ExchangeTest, ReportsTheInstantsOfATransaction) {
    BusScript bus{settings};
    const TimePoint asked = bus.now();
    answer_one(bus);
    ASSERT_EQ(bus.exchanges.size(), 1u);
    const Exchange& told = bus.exchanges[0];
    EXPECT_EQ(told.transaction, 1u);
    EXPECT_EQ(told.station, 17);
    EXPECT_EQ(told.end, TransactionEnd::ok);
    EXPECT_EQ(told.arrived, asked);
    EXPECT_EQ(told.granted, bus.sent[0].at);
    EXPECT_EQ(told.first_bit_out, told.granted);
    EXPECT_EQ(told.last_bit_out - told.first_bit_out, frame_time(settings.serial, 8));
    const Duration reply = frame_time(settings.serial, 11);
    EXPECT_NEAR(to_milliseconds(*told.first_byte_in - told.last_bit_out), 5, 0.3);
    EXPECT_NEAR(to_milliseconds(*told.last_byte_in - *told.first_byte_in), to_milliseconds(reply),
                0.3);
}

TEST_F(ExchangeTest, BeginsToSendWhenTheLinesLeadIsOver) {
    BusScript bus{settings};
    bus.arbiter().set_lead(3ms);
    bus.submit(17, kRead);
    bus.run_for(2s);
    ASSERT_FALSE(bus.exchanges.empty());
    EXPECT_EQ(bus.exchanges[0].first_bit_out, bus.exchanges[0].granted + 3ms);
}

TEST_F(ExchangeTest, EachAttemptIsATransactionAndTheAnswerNamesThemAll) {
    BusScript bus{settings};
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_for(3s);
    ASSERT_TRUE(bus.answered(ticket));
    EXPECT_EQ(ends(bus), (std::vector<std::string>{"timeout", "timeout"}));
    EXPECT_EQ(bus.answer(ticket).transactions, (std::vector<Transaction>{1, 2}));
    EXPECT_FALSE(bus.exchanges[0].first_byte_in);
    const Ticket other = bus.submit(18, kRead);
    bus.run_to_end_of_request();
    bus.run_for(5ms);
    bus.hear_reply(18, "83 02"_hex);
    bus.run_for(20ms);
    EXPECT_EQ(bus.answer(other).transactions, std::vector<Transaction>{3});
    EXPECT_EQ(ends(bus).back(), "exception");
}

TEST_F(ExchangeTest, ReadsThatShareATransactionNameTheSame) {
    BusScript bus{settings};
    bus.submit(18, kRead, 9);
    const Ticket one = bus.submit(17, kRead, 1);
    const Ticket two = bus.submit(17, kRead, 2);
    bus.run_to_end_of_request();
    bus.run_for(5ms);
    bus.hear_reply(18, kReply);
    ASSERT_TRUE(bus.next_sent());
    bus.run_to_end_of_request();
    bus.run_for(5ms);
    bus.hear_reply(17, kReply);
    bus.run_for(20ms);
    EXPECT_EQ(bus.answer(one).transactions, std::vector<Transaction>{2});
    EXPECT_EQ(bus.answer(two).transactions, std::vector<Transaction>{2});
}

TEST_F(ExchangeTest, ReportsWhatWasDamagedWrongBroadcastOrLost) {
    settings.unlisted.retries = settings.stations[0].retries = settings.stations[1].retries = 0;
    BusScript bus{settings};
    bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.run_for(5ms);
    bus.hear("11 03 06 02 2B 00 00 00 64 C8 BB"_hex);
    bus.run_for(2s);
    bus.submit(18, kRead);
    bus.run_to_end_of_request();
    bus.run_for(5ms);
    bus.hear_reply(18, "84 01"_hex);
    bus.run_for(2s);
    bus.submit(0, kWrite);
    bus.run_for(1s);
    bus.submit(18, kRead);
    bus.line_down();
    EXPECT_EQ(ends(bus), (std::vector<std::string>{"damaged", "wrong", "ok", "line_down"}));
    EXPECT_EQ(bus.exchanges[2].station, 0);
    EXPECT_TRUE(bus.exchanges[0].first_byte_in);
}

TEST_F(ExchangeTest, WhatIsRefusedHasCostNone) {
    BusScript bus{settings};
    bus.line_down();
    EXPECT_FALSE(bus.try_submit(17, kRead).has_value());
    EXPECT_TRUE(bus.exchanges.empty());
}

TEST_F(ExchangeTest, NothingIsReportedWithoutExplain) {
    settings.explain = false;
    BusScript bus{settings};
    answer_one(bus);
    EXPECT_TRUE(bus.exchanges.empty());
}

}  // namespace
}  // namespace panelgate::arbiter::exchange_test
