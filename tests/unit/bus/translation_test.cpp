#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "panelgate/bus/bus.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"
#include "support/manual_clock.hpp"
#include "support/memory_line.hpp"
#include "support/request.hpp"

namespace panelgate::bus::translation_test {
namespace {

const Bytes kWord = "06 00 64 12 34"_hex;
const Bytes kWordSent = "10 00 64 00 01 02 12 34"_hex;
const Bytes kWordReply = "10 00 64 00 01"_hex;

/// Station 17 has no functions for single items or inputs; 18 is not translated.
class BusTranslatesTest : public testing::Test {
  protected:
    BusTranslatesTest() {
        settings.name = "floor1";
        settings.arbiter.serial = {1000000, 8, Parity::none, 1};
        settings.arbiter.unlisted.response_timeout = 5ms;
        settings.stations[17].name = "press";
        settings.stations[17].translate = modbus::translated;
        settings.stations[18].name = "oven";
    }
    void make_bus() {
        auto memory = std::make_unique<test::MemoryLine>(clock);
        line = memory.get();
        bus = std::make_unique<Bus>(io.get_executor(), clock, settings, std::move(memory));
        bus->start();
    }
    void ask(std::uint8_t station, const Bytes& pdu, std::vector<Answer>& answers) {
        bus->transact({.station = station, .request = test::request_of(pdu), .client = 1},
                      [&answers](Answer answer) { answers.push_back(std::move(answer)); });
    }
    /// Returns the answer to `pdu` when the panel replies with `reply`.
    Answer answer(std::uint8_t station, const Bytes& pdu, const Bytes& reply) {
        if (!bus) make_bus();
        line->reply = reply;
        std::vector<Answer> answers;
        ask(station, pdu, answers);
        EXPECT_TRUE(test::run_until(io, clock, [&] { return !answers.empty(); }));
        return answers.empty() ? Answer{} : answers.front();
    }
    const StationReport& report_of(std::size_t place) {
        report = bus->report();
        return report.stations[place];
    }

    boost::asio::io_context io{1};
    test::ManualClock clock;
    Settings settings;
    LineReport report;
    test::MemoryLine* line = nullptr;
    std::unique_ptr<Bus> bus;
};

TEST_F(BusTranslatesTest, WhatThePanelLacksGoesOutAsWhatItHasAndTheClientGetsItsOwnBack) {
    const Answer written = answer(17, kWord, kWordReply);
    EXPECT_EQ(written.pdu.value(), kWord);
    EXPECT_TRUE(written.transmitted);
    EXPECT_EQ(line->written.back(), modbus::encode_adu(17, kWordSent));
    const Answer read = answer(17, "04 00 64 00 01"_hex, "03 02 00 0A"_hex);
    EXPECT_EQ(read.pdu.value(), "04 02 00 0A"_hex);
}

TEST_F(BusTranslatesTest, ThePanelsExceptionIsThatOfTheFunctionAsked) {
    EXPECT_EQ(answer(17, kWord, "90 03"_hex).pdu.value(), "86 03"_hex);
}

TEST_F(BusTranslatesTest, P1AnEchoOfTheFunctionAskedIsNoAnswerToTheOneSent) {
    EXPECT_FALSE(answer(17, kWord, kWord).pdu.has_value());
}

TEST_F(BusTranslatesTest, P2SilenceLeavesTheOutcomeUnknownAndTheWriteIsSentOnce) {
    const Answer silent = answer(17, kWord, {});
    EXPECT_EQ(silent.pdu.error(), Fault::timeout);
    EXPECT_TRUE(silent.transmitted);
    EXPECT_EQ(line->written.size(), 1u);
}

TEST_F(BusTranslatesTest, OthersAndBroadcastsGoOutAsTheyCame) {
    EXPECT_EQ(answer(18, kWord, kWord).pdu.value(), kWord);
    EXPECT_EQ(line->written.back(), modbus::encode_adu(18, kWord));
    EXPECT_EQ(answer(0, kWord, {}).pdu.value(), kWord);
    EXPECT_EQ(line->written.back(), modbus::encode_adu(0, kWord));
}

TEST_F(BusTranslatesTest, TraceAndCountersShowBothFunctions) {
    answer(17, kWord, kWordReply);
    const TraceFrame sent = bus->trace(2).frames.front();
    EXPECT_EQ(sent.bytes, modbus::encode_adu(17, kWordSent));
    EXPECT_TRUE(sent.why.ends_with(", instead of function 6")) << sent.why;
    const StationReport& press = report_of(1);
    EXPECT_EQ(press.requests.at(6)[Outcome::ok], 1u);
    EXPECT_FALSE(press.requests.contains(16));
    EXPECT_EQ(press.translated.at({6, 16}), 1u);
}

TEST_F(BusTranslatesTest, AGuardJudgesWhatWasAsked) {
    settings.stations[17].guard = [](const modbus::Request& request) {
        return request.function() == 6 ? std::optional(Objection{Rule::function, "no function 6"})
                                       : std::nullopt;
    };
    EXPECT_EQ(answer(17, kWord, kWordReply).pdu.value(), "86 01"_hex);
    EXPECT_TRUE(line->written.empty());
    EXPECT_TRUE(report_of(1).translated.empty());
}

TEST_F(BusTranslatesTest, P6ReadsOfTheSameItemsByBothFunctionsShareOneTransaction) {
    make_bus();
    line->reply = "03 02 00 0A"_hex;
    std::vector<Answer> answers;
    ask(18, "03 00 01 00 01"_hex, answers);  // keeps the line busy
    ask(17, "03 00 64 00 01"_hex, answers);
    ask(17, "04 00 64 00 01"_hex, answers);
    ASSERT_TRUE(test::run_until(io, clock, [&] { return answers.size() == 3; }));
    EXPECT_EQ(line->written.size(), 2u);
    EXPECT_EQ(answers[1].pdu.value(), "03 02 00 0A"_hex);
    EXPECT_EQ(answers[2].pdu.value(), "04 02 00 0A"_hex);
}

}  // namespace
}  // namespace panelgate::bus::translation_test
