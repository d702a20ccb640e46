#include "panelgate/bus/listening_bus.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "bus_case.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"
#include "support/manual_clock.hpp"
#include "support/memory_line.hpp"
#include "support/request.hpp"

namespace panelgate::bus::listening_bus_test {
namespace {

class ListeningBusTest : public testing::Test {
  protected:
    ListeningBusTest() {
        settings.name = "floor1";
        settings.device = "memory";
        settings.arbiter.serial = {38400, 8, Parity::none, 1};
        settings.arbiter.offline.after = 3;
        settings.stations[17].name = "press";
        settings.doctor.rest = {};
        settings.observe = [this](const BusEvent& event) {
            if (const auto* made = std::get_if<tap::Transaction>(&event)) heard.push_back(*made);
            if (const auto* made = std::get_if<TransactionEvent>(&event))
                outcomes.push_back(made->outcome);
            if (const auto* made = std::get_if<arbiter::StationEvent>(&event))
                told += std::to_string(made->station) + ':' + std::string(label(made->kind)) + ' ';
        };
        auto memory = std::make_unique<test::MemoryLine>(clock);
        line = memory.get();
        bus = std::make_unique<ListeningBus>(io.get_executor(), clock, settings, std::move(memory));
        bus->start();
    }
    /// A frame arrives this long after the one before.
    void hear(Duration pause, std::uint8_t station, const Bytes& pdu) {
        const Bytes adu = modbus::encode_adu(station, pdu);
        clock.advance(pause + wire_time(settings.arbiter.serial, adu.size()));
        line->come(adu);
        line->poll_input();
    }
    /// A read of this station and its reply.
    void hear_exchange(std::uint8_t station) {
        hear(10ms, station, kRead);
        hear(4ms, station, kReply);
    }
    StationReport report_of(const std::string& name) const {
        for (const StationReport& station : bus->report().stations) {
            if (station.station == name) return station;
        }
        return {};
    }

    boost::asio::io_context io{1};
    test::ManualClock clock;
    Settings settings;
    test::MemoryLine* line = nullptr;
    std::unique_ptr<ListeningBus> bus;
    std::vector<tap::Transaction> heard;
    std::vector<Outcome> outcomes;
    std::string told;  ///< of stations
};

TEST_F(ListeningBusTest, TellsWhatPassesBy) {
    EXPECT_EQ(bus->station_status(17).state, Health::unknown);
    hear_exchange(17);
    ASSERT_EQ(heard.size(), 1u);
    EXPECT_EQ(heard[0].reply, kReply);
    EXPECT_EQ(outcomes, std::vector{Outcome::ok});
    EXPECT_EQ(bus->station_status(17).state, Health::heard);
    EXPECT_EQ(bus->station_status(17).last_success, 0ms);
    const HeardCounts counts = bus->station_status(17).heard.value();
    EXPECT_EQ(counts.requests, 1u);
    EXPECT_EQ(counts.replies, 1u);
    EXPECT_NEAR(to_milliseconds(counts.think), 4, 0.001);
    const StationReport report = report_of("press");
    EXPECT_EQ(report.requests.at(3)[Outcome::ok], 1u);
    EXPECT_EQ(report.up, true);
    EXPECT_GT(report.last_success_unix, 0);
    EXPECT_NEAR(report.wire.turnaround.sum, 0.004, 1e-6);
    const auto trace = bus->trace(10).frames;
    ASSERT_EQ(trace.size(), 2u);
    EXPECT_EQ(trace[0].kind, FrameKind::heard_request);
    EXPECT_EQ(trace[1].kind, FrameKind::reply);
    EXPECT_EQ(bus->trace_since(trace[0].sequence, 10).frames.size(), 1u);
    EXPECT_TRUE(bus->status().listens);
}

TEST_F(ListeningBusTest, SaysWhoDoesNotAnswerItsMaster) {
    for (int i = 0; i < 4; ++i) hear(300ms, 17, kRead);
    EXPECT_EQ(bus->station_status(17).state, Health::offline);
    EXPECT_EQ(report_of("press").up, false);
    EXPECT_EQ(report_of("press").requests.at(3)[Outcome::timeout], 3u);
    hear(4ms, 17, kReply);
    EXPECT_EQ(bus->station_status(17).state, Health::heard);
    hear(10ms, 17, kRead);
    hear(4ms, 17, "83 02"_hex);
    EXPECT_EQ(report_of("press").wire.exceptions.at(2), 1u);
    const HeardCounts counts = bus->station_status(17).heard.value();
    EXPECT_EQ(counts.timeouts, 3u);
    EXPECT_EQ(counts.exceptions, 1u);
}

TEST_F(ListeningBusTest, P1TakesNoValueFromAReplyThatMayBeLate) {
    hear(10ms, 17, "03 00 64 00 01"_hex);
    hear(200ms, 17, kRead);
    hear(4ms, 17, "83 02"_hex);
    ASSERT_EQ(heard.size(), 2u);
    EXPECT_TRUE(heard[1].doubtful);
    EXPECT_EQ(bus->station_status(17).heard.value().doubtful, 1u);
}

TEST_F(ListeningBusTest, CountsWhatNobodyListedTogether) {
    hear_exchange(5);
    hear(10ms, 0, "06 00 64 00 07"_hex);
    EXPECT_EQ(report_of("other").requests.at(3)[Outcome::ok], 1u);
    EXPECT_EQ(bus->report().wire.broadcasts, 1u);
    EXPECT_EQ(bus->report().stations.size(), 2u);
}

TEST_F(ListeningBusTest, RefusesEveryRequestAndSendsNothing) {
    std::vector<Answer> answers;
    const auto ask = [&](std::uint8_t station, const Bytes& pdu) {
        bus->transact({.station = station, .request = test::request_of(pdu), .client = 1},
                      [&](Answer answer) { answers.push_back(std::move(answer)); });
    };
    ask(17, kRead);
    ask(17, "06 00 01 00 03"_hex);
    ask(0, "06 00 01 00 03"_hex);
    EXPECT_TRUE(answers.empty()) << "answered from inside transact()";
    ASSERT_TRUE(test::run_until(io, clock, [&] { return answers.size() == 3; }));
    EXPECT_EQ(answers[0].pdu.value(), "83 0A"_hex);
    EXPECT_EQ(answers[1].pdu.value(), "86 0A"_hex);
    for (const Answer& answer : answers) {
        EXPECT_FALSE(answer.transmitted);
        EXPECT_EQ(answer.refusal.value().rule, Rule::listening);
    }
    EXPECT_EQ(bus->write_refusal(17).value().rule, Rule::listening);
    EXPECT_EQ(report_of("press").requests.at(6)[Outcome::refused], 1u);
    EXPECT_TRUE(line->written.empty());
}

TEST_F(ListeningBusTest, SaysThatTheLineIsDown) {
    hear(10ms, 17, kRead);
    line->events()->on_down("unplugged");
    EXPECT_FALSE(bus->status().up);
    EXPECT_EQ(bus->status().state, "down: unplugged");
    ASSERT_EQ(heard.size(), 1u);
    EXPECT_TRUE(heard[0].doubtful);
    EXPECT_TRUE(outcomes.empty()) << "nobody here knows what came of it";
}

TEST_F(ListeningBusTest, P10ALineThatIsDownTakesWhatIsKnownOfItsStationsAlong) {
    hear_exchange(17);
    hear_exchange(17);
    EXPECT_EQ(told, "17:heard ");
    line->events()->on_down("unplugged");
    EXPECT_EQ(bus->station_status(17).state, Health::unknown);
    EXPECT_EQ(told, "17:heard 17:unknown ");
    line->events()->on_up();
    EXPECT_EQ(bus->station_status(17).state, Health::heard);
    EXPECT_EQ(told, "17:heard 17:unknown 17:heard ");
    bus->stop();
    EXPECT_EQ(told, "17:heard 17:unknown 17:heard 17:unknown ") << "the line is driven now";
}

TEST_F(ListeningBusTest, P10WhatASilenceSaidIsWithdrawnWithTheLine) {
    for (int i = 0; i < 7; ++i) hear(300ms, 17, kRead);
    hear(300ms, 18, kRead);
    hear(4ms, 18, kReply);
    ASSERT_EQ(bus->status().findings.size(), 1u);
    EXPECT_EQ(bus->status().findings[0].cause, "station-silent");
    line->events()->on_down("unplugged");
    EXPECT_TRUE(bus->status().findings.empty());
}

TEST_F(ListeningBusTest, RecordsTheTransactionsOfItsMaster) {
    hear_exchange(17);
    hear(10ms, 17, "83 02"_hex);  // no request
    hear(10ms, 18, kRead);
    hear(10ms, 18, "83 02"_hex);
    const auto all = bus->trace(9).transactions;
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(all[0].id, 1u);
    EXPECT_EQ(all[0].reason, "heard request");
    EXPECT_EQ(all[0].end, TransactionEnd::ok);
    EXPECT_EQ(all[0].request, modbus::encode_adu(17, kRead));
    EXPECT_EQ(all[0].reply, modbus::encode_adu(17, kReply));
    EXPECT_NEAR(to_milliseconds(*all[0].first_byte_in - all[0].last_bit_out), 4, 0.001);
    EXPECT_FALSE(all[0].arrived);
    EXPECT_FALSE(all[0].answered);
    EXPECT_EQ(all[0].discarded.size(), 1u);
    EXPECT_EQ(all[1].end, TransactionEnd::exception);
    EXPECT_EQ(bus->trace_since(all[0].sequence, 9).transactions.size(), 1u);
    EXPECT_TRUE(bus->incidents().empty());
}

TEST_F(ListeningBusTest, KeepsWhatHappenedAroundASilence) {
    hear_exchange(17);
    hear(10ms, 17, kRead);
    hear(2s, 18, kRead);  // the master has gone on
    hear(4ms, 18, kReply);
    const auto heads = bus->incidents();
    ASSERT_EQ(heads.size(), 1u);
    EXPECT_EQ(heads[0].cause, "timeout");
    EXPECT_EQ(heads[0].station, 17);
    EXPECT_EQ(bus->incident(1)->part.transactions.size(), 3u);
    EXPECT_FALSE(bus->incident(2));
}

}  // namespace
}  // namespace panelgate::bus::listening_bus_test
