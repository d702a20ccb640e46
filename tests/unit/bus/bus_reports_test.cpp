// What a bus reports of its line besides answers: writes, refusals, load; transactions with their
// instants, and what happened around errors.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "bus_case.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/rt/log.hpp"
#include "support/hex.hpp"

namespace panelgate::bus::bus_reports_test {
namespace {

class BusReportsTest : public BusCase {
  protected:
    BusReportsTest() { start_bus(); }
};

TEST_F(BusReportsTest, WhoHasHungUpKeepsItsRow) {
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
    start_bus();
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
    bus.reset();
}

/// minimalmodbus#101
TEST_F(BusReportsTest, TellsWhereAWriteHasChangedAPanelsAddress) {
    const rt::LogTap log;
    start_bus();
    line->reply.clear();
    for (const std::uint8_t value : Bytes{6, 5}) {
        const Bytes write{0x06, 0x00, 0x0A, 0x00, value};
        std::vector<Answer> answers;
        const std::size_t before = line->written.size();
        send(17, write, answers);
        EXPECT_TRUE(run_until([&] { return line->written.size() > before; }));
        clock.advance(2ms);
        line->come(modbus::encode_adu(5, write));
        line->poll_input();
        EXPECT_TRUE(run_until([&] { return !answers.empty(); }));
        EXPECT_EQ(end_of(answers.at(0)), "timeout, sent");
    }
    EXPECT_EQ(log.count("write answered by another address"), 1u) << "5 was written";
    EXPECT_EQ(log.count("station 5 has answered with this very write"), 1u);
}

TEST_F(BusReportsTest, CountsAndLogsAWriteThatWasRefusedBeforeItWasARequest) {
    const rt::LogTap log;
    const WhoRef who = make_who({.face = Face::modbus_tcp, .name = "modbus_tcp 10.0.0.5:1"});
    bus->count_refused(17, "06 00"_hex, who);
    bus->count_refused(0, "05 00 01 FF 00"_hex, who);
    bus->count_refused(17, "03 00"_hex, who);
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

TEST_F(BusReportsTest, WhatIsNoFunctionIsNoWrite) {
    const rt::LogTap log;
    bus->count_refused(17, "00"_hex, {});
    bus->count_refused(17, "83 02"_hex, {});
    EXPECT_EQ(log.count("write"), 0u);
    bus->count_refused(17, "41 02"_hex, {});
    EXPECT_EQ(log.count("write"), 1u) << "nobody knows what it does";
}

TEST_F(BusReportsTest, EveryAcceptedWriteIsInTheLogWhoeverElseHasWritten) {
    line->reply = kWrite;
    const rt::LogTap log;
    who = make_who({.face = Face::http, .name = "http ::1 token alice"});
    for (int i = 0; i < 100; ++i) ask(17, kWrite);
    EXPECT_EQ(log.count("token alice"), 1u) << "the same again is gathered";
    who = make_who({.face = Face::http, .name = "http ::1 token bob"});
    ask(17, kWrite);
    EXPECT_EQ(log.count("token bob"), 1u);
    EXPECT_EQ(log.count("repeated=99 first="), 1u) << "in one line, before what follows it";
    ask_silent(17, kWrite);
    EXPECT_EQ(log.count("token bob"), 2u) << "it was sent, and nobody knows what came of it";
    EXPECT_EQ(log.count("outcome=timeout"), 1u);
}

TEST_F(BusReportsTest, P10TheLoadIsOfTheLastTenSecondsWhoeverAskedBefore) {
    for (int i = 0; i < 20; ++i) {
        ask(17);
        clock.advance(100ms);
    }
    EXPECT_GT(bus->status().load_percent, 0);
    EXPECT_EQ(bus->status().load_percent, bus->status().load_percent);
    clock.advance(25s);
    EXPECT_EQ(bus->status().load_percent, 0) << "idle since, and nobody has asked";
}

TEST_F(BusReportsTest, CountsHowOftenAStationMayHaveBeenRestarted) {
    ask(17);
    const std::uint64_t before = bus->station_status(17).returns;
    ask_silent(17);
    ask(17);
    EXPECT_EQ(bus->station_status(17).returns, before + 1) << "it was silent";
    line->events()->on_down("pulled");
    line->events()->on_up();
    EXPECT_EQ(bus->station_status(17).returns, before + 2) << "the line was away";
}

class BusTrace : public BusCase {
  protected:
    BusTrace() {
        settings.arbiter.unlisted.retries = 0;
        settings.arbiter.queue.deadline = 200ms;
        settings.arbiter.offline.after = 1000;
        list({17});
        start_bus();
    }
    void ask_often(int times) {
        for (int i = 0; i < times; ++i) ask(17);
    }
    /// Sends one request without a reply. Uses another function, so that its reply cannot stay
    /// outstanding for later requests.
    void fail() { ask_silent(17, "04 00 64 00 01"_hex); }
    /// "1:timeout 2:late": ids and causes.
    std::string incidents() const {
        std::string text;
        for (const IncidentHead& one : bus->incidents())
            text += (text.empty() ? "" : " ") + std::to_string(one.id) + ':' + one.cause;
        return text;
    }
};

TEST_F(BusTrace, ATransactionHasItsInstantsFramesClientAndReason) {
    bus->name_client(1, "http 10.0.0.9");
    const TimePoint asked = clock.now();
    EXPECT_EQ(ask(17).transactions.last(), 1u);
    const auto all = bus->trace(9).transactions;
    ASSERT_EQ(all.size(), 1u);
    const TraceTransaction& one = all[0];
    EXPECT_EQ(one.id, 1u);
    EXPECT_EQ(one.station, 17);
    EXPECT_EQ(one.reason, "read");
    EXPECT_EQ(one.client, "http 10.0.0.9");
    EXPECT_EQ(one.end, TransactionEnd::ok);
    EXPECT_EQ(one.request, line->written[0]);
    EXPECT_EQ(one.reply, "11 03 06 02 2B 00 00 00 64 C8 BA"_hex);
    EXPECT_EQ(one.arrived, asked);
    EXPECT_GE(one.granted, asked);
    EXPECT_GT(one.last_bit_out, one.first_bit_out);
    EXPECT_GE(one.last_byte_in.value(), one.first_byte_in.value());
    EXPECT_GE(one.answered.value(), *one.last_byte_in);
    const auto frames = bus->trace(9).frames;
    EXPECT_EQ(frames.at(0).sequence, one.first);
    EXPECT_EQ(frames.at(0).transaction, 1u);
    EXPECT_EQ(frames.at(1).transaction, 1u);
    EXPECT_GT(one.sequence, frames.at(1).sequence);
}

TEST_F(BusTrace, OneThatGivesUpIsAnsweredByItsLastAttempt) {
    settings.arbiter.unlisted.retries = 1;
    list({17});
    start_bus();
    const Answer answer = ask_silent(17);
    const auto all = bus->trace(9).transactions;
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(all[1].reason, "retry");
    EXPECT_FALSE(all[0].answered);
    EXPECT_TRUE(all[1].answered);
    std::vector<arbiter::Transaction> named;
    answer.transactions.for_each([&](arbiter::Transaction number) { named.push_back(number); });
    EXPECT_EQ(named, (std::vector<arbiter::Transaction>{1, 2}));
}

TEST_F(BusTrace, KeepsWhatHappenedAroundAnError) {
    ask_often(40);
    EXPECT_EQ(incidents(), "");
    fail();
    EXPECT_EQ(incidents(), "1:timeout");
    EXPECT_FALSE(bus->incidents()[0].complete);
    ask_often(40);
    const IncidentHead head = bus->incidents().at(0);
    EXPECT_TRUE(head.complete);
    EXPECT_EQ(head.station, 17);
    EXPECT_EQ(head.errors, 1u);
    const auto incident = bus->incident(1);
    ASSERT_TRUE(incident);
    ASSERT_EQ(incident->part.transactions.size(), 33u);
    EXPECT_EQ(incident->part.transactions[16].end, TransactionEnd::timeout);
    EXPECT_EQ(incident->part.transactions[15].id, 40u);
    EXPECT_EQ(incident->part.transactions[32].end, TransactionEnd::ok);
    for (const TraceTransaction& one : incident->part.transactions) {
        if (one.end == TransactionEnd::ok) EXPECT_EQ(one.request, line->written[0]) << one.id;
    }
    EXPECT_FALSE(bus->incident(2));
}

TEST_F(BusTrace, NearErrorsAreOneIncidentAndWhatGoesOnIsNoNews) {
    fail();
    ask_often(3);
    fail();
    ask_often(30);
    EXPECT_EQ(incidents(), "1:timeout");
    EXPECT_EQ(bus->incidents()[0].errors, 2u);
    for (int i = 0; i < 100; ++i) fail();
    ask_often(30);
    EXPECT_EQ(incidents(), "1:timeout 2:timeout") << "the station was silent all the time";
}

TEST_F(BusTrace, ErrorsFarApartInTimeAreTwo) {
    ask(17);
    fail();
    ask(17);
    clock.advance(11s);
    fail();
    EXPECT_EQ(incidents(), "1:timeout 2:timeout");
    EXPECT_TRUE(bus->incidents()[0].complete);
}

TEST_F(BusTrace, WhatWasReadGivesWayFirstAndThenTheOldest) {
    settings.incidents.incidents = 3;
    start_bus();
    const auto happen = [&] {
        fail();
        ask_often(20);
    };
    for (int i = 0; i < 3; ++i) happen();
    EXPECT_EQ(incidents(), "1:timeout 2:timeout 3:timeout");
    EXPECT_TRUE(bus->incident(2));
    EXPECT_TRUE(bus->incidents()[1].read);
    happen();
    EXPECT_EQ(incidents(), "1:timeout 3:timeout 4:timeout");
    happen();
    EXPECT_EQ(incidents(), "3:timeout 4:timeout 5:timeout");
    EXPECT_EQ(bus->incident(5)->part.transactions.front().end, TransactionEnd::ok);
}

TEST_F(BusTrace, TheLossOfTheLineIsAnIncidentUnlessItWasNeverThere) {
    line->events()->on_down("no such device");
    EXPECT_EQ(incidents(), "");
    start_bus();
    ask(17);
    line->events()->on_down("unplugged");
    EXPECT_EQ(incidents(), "1:line_down");
    EXPECT_FALSE(bus->incidents()[0].station);
    line->events()->on_down("unplugged");
    EXPECT_EQ(bus->incidents()[0].errors, 1u) << "it was down";
}

TEST_F(BusTrace, ALongIncidentKeepsItsBeginning) {
    settings.incidents.each = {20, 128, 32, 8192, 4096};
    start_bus();
    ask_often(5);
    for (int i = 0; i < 50; ++i) fail();
    ASSERT_EQ(incidents(), "1:timeout");
    const auto incident = bus->incident(1);
    EXPECT_EQ(incident->part.transactions.size(), 20u);
    EXPECT_EQ(incident->part.transactions.front().id, 1u);
    EXPECT_TRUE(incident->head.complete);
}

}  // namespace
}  // namespace panelgate::bus::bus_reports_test
