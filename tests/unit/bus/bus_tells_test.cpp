#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "panelgate/bus/bus.hpp"
#include "panelgate/rt/log.hpp"
#include "support/hex.hpp"
#include "support/manual_clock.hpp"
#include "support/memory_line.hpp"
#include "support/request.hpp"

namespace panelgate::bus::bus_tells_test {
namespace {

const Bytes kRead = "03 00 6B 00 03"_hex;
const Bytes kReply = "03 06 02 2B 00 00 00 64"_hex;
const Bytes kWrite = "06 00 01 00 03"_hex;

/// What a bus reports of its line besides answers.
class BusReportsTest : public testing::Test {
  protected:
    BusReportsTest() {
        settings.name = "floor1";
        settings.arbiter.serial = {1000000, 8, Parity::none, 1};
        settings.arbiter.unlisted.response_timeout = 5ms;
        settings.arbiter.stations = {settings.arbiter.unlisted};
        settings.arbiter.stations[0].id = 17;
        make_bus();
    }
    void make_bus() {
        auto memory = std::make_unique<test::MemoryLine>(clock);
        line = memory.get();
        line->reply = kReply;
        bus = std::make_unique<Bus>(io.get_executor(), clock, settings, std::move(memory));
    }
    /// Sends a request and runs the loop until it is answered.
    void ask(std::uint8_t station, const Bytes& pdu, ClientId client = 1) {
        std::optional<Answer> got;
        bus->transact({.station = station, .request = test::request_of(pdu), .client = client},
                      [&](Answer answer) { got = std::move(answer); });
        EXPECT_TRUE(test::run_until(io, clock, [&] { return got.has_value(); }));
    }

    boost::asio::io_context io{1};
    test::ManualClock clock;
    Settings settings;
    test::MemoryLine* line = nullptr;
    std::unique_ptr<Bus> bus;
};

TEST_F(BusReportsTest, WhoHasHungUpKeepsItsRow) {
    bus->start();
    for (ClientId client = 1; client <= 3; ++client) {
        bus->name_client(client, "modbus_tcp 10.0.0.7:500" + std::to_string(client));
        ask(17, kRead, client);
        bus->cancel(client);
    }
    const auto clients = bus->clients();
    ASSERT_EQ(clients.size(), 1u);
    EXPECT_EQ(clients[0].name, "modbus_tcp 10.0.0.7");
    EXPECT_EQ(clients[0].percent, 100);
    EXPECT_TRUE(clients[0].gone);
}

TEST_F(BusReportsTest, P6TellsOfEveryWriteBeforeItsAnswer) {
    std::vector<WriteEvent> writes;
    settings.observe = [&](const BusEvent& event) {
        if (const auto* write = std::get_if<WriteEvent>(&event)) writes.push_back(*write);
    };
    make_bus();
    bus->start();
    ask(17, kRead);
    EXPECT_TRUE(writes.empty());
    line->reply = kWrite;
    ask(17, kWrite);
    ASSERT_EQ(writes.size(), 2u);
    EXPECT_EQ(writes[0].items, (modbus::Span{modbus::Table::holding_registers, 1, 1}));
    EXPECT_FALSE(writes[0].ended);
    EXPECT_EQ(writes[0].client, 1u);
    EXPECT_TRUE(writes[1].ended);
    line->fail_writes = true;
    ask(0, kWrite);
    ASSERT_EQ(writes.size(), 4u) << "lost on its way: nobody knows what has come of it";
    EXPECT_EQ(writes[3].station, 0);
}

TEST_F(BusReportsTest, CountsAndLogsAWriteThatWasRefusedBeforeItWasARequest) {
    settings.stations[17].name = "press";
    make_bus();
    const rt::LogTap log;
    bus->name_client(1, "modbus_tcp 10.0.0.5:1");
    bus->tell_refused(17, "06 00"_hex, 1);
    bus->tell_refused(0, "05 00 01 FF 00"_hex, 1);
    bus->tell_refused(17, "03 00"_hex, 1);
    ASSERT_EQ(log.lines().size(), 2u) << "nobody asks who has read what";
    EXPECT_EQ(log.lines()[0],
              "info write line=floor1 station=press client=\"modbus_tcp 10.0.0.5:1\" "
              "pdu=0600 outcome=refused")
        << "no address could be told";
    EXPECT_EQ(log.count("station=broadcast client=\"modbus_tcp 10.0.0.5:1\" at=coils/1 "), 1u);
    const LineReport report = bus->report();
    const auto& press = report.stations.back();
    EXPECT_EQ(press.requests.at(6)[Outcome::refused], 1u);
    EXPECT_EQ(press.requests.at(3)[Outcome::refused], 1u);
    EXPECT_EQ(report.stations.front().requests.at(5)[Outcome::refused], 1u);
}

TEST_F(BusReportsTest, EveryAcceptedWriteIsInTheLogWhoeverElseHasWritten) {
    make_bus();
    bus->start();
    line->reply = kWrite;
    const rt::LogTap log;
    bus->name_client(1, "http ::1 token alice");
    for (int i = 0; i < 100; ++i) ask(17, kWrite);
    EXPECT_EQ(log.count("token alice"), 1u) << "the same again is gathered";
    bus->name_client(1, "http ::1 token bob");
    ask(17, kWrite);
    EXPECT_EQ(log.count("token bob"), 1u);
    EXPECT_EQ(log.count("repeated=99 first="), 1u) << "in one line, before what follows it";
    line->reply.clear();
    ask(17, kWrite);
    EXPECT_EQ(log.count("token bob"), 2u) << "it was sent, and nobody knows what came of it";
    EXPECT_EQ(log.count("outcome=timeout"), 1u);
}

TEST_F(BusReportsTest, WhatIsNoFunctionIsNoWrite) {
    make_bus();
    const rt::LogTap log;
    bus->tell_refused(17, "00"_hex, 1);
    bus->tell_refused(17, "83 02"_hex, 1);
    EXPECT_EQ(log.count("write"), 0u);
    bus->tell_refused(17, "41 02"_hex, 1);
    EXPECT_EQ(log.count("write"), 1u) << "nobody knows what it does";
}

TEST_F(BusReportsTest, P10TheLoadIsOfTheLastTenSecondsWhoeverAskedBefore) {
    bus->start();
    for (int i = 0; i < 20; ++i) {
        ask(17, kRead);
        clock.advance(100ms);
    }
    EXPECT_GT(bus->status().load_percent, 0);
    EXPECT_EQ(bus->status().load_percent, bus->status().load_percent);
    clock.advance(25s);
    EXPECT_EQ(bus->status().load_percent, 0) << "idle since, and nobody has asked";
}

TEST_F(BusReportsTest, CountsHowOftenAStationMayHaveBeenRestarted) {
    bus->start();
    ask(17, kRead);
    const std::uint64_t before = bus->station_status(17).returns;
    line->reply.clear();
    ask(17, kRead);
    line->reply = kReply;
    ask(17, kRead);
    EXPECT_EQ(bus->station_status(17).returns, before + 1) << "it was silent";
    line->events()->on_down("pulled");
    line->events()->on_up();
    EXPECT_EQ(bus->station_status(17).returns, before + 2) << "the line was away";
}

}  // namespace
}  // namespace panelgate::bus::bus_tells_test
