// A line's records: transactions with their instants, and what happened around errors.
#include <gmock/gmock.h>

#include <boost/asio/io_context.hpp>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/bus/bus.hpp"
#include "support/hex.hpp"
#include "support/manual_clock.hpp"
#include "support/memory_line.hpp"
#include "support/request.hpp"

namespace panelgate::bus::bus_trace_test {
namespace {

const Bytes kRead = "03 00 6B 00 03"_hex;
const Bytes kReply = "03 06 02 2B 00 00 00 64"_hex;

class BusTrace : public testing::Test {
  protected:
    BusTrace() {
        settings.name = "floor1";
        settings.arbiter.serial = {1000000, 8, Parity::none, 1};
        settings.arbiter.unlisted.response_timeout = 5ms;
        settings.arbiter.unlisted.retries = 0;
        settings.arbiter.queue.deadline = 200ms;
        settings.arbiter.offline.after = 1000;
        settings.arbiter.stations = {settings.arbiter.unlisted};
        settings.arbiter.stations[0].id = 17;
        settings.stations[17].name = "press";
        settings.doctor.rest = {};
        make_bus();
    }
    void make_bus() {
        auto memory = std::make_unique<test::MemoryLine>(clock);
        line = memory.get();
        line->reply = kReply;
        bus = std::make_unique<Bus>(io.get_executor(), clock, settings, std::move(memory));
        bus->start();
    }
    Answer ask(const Bytes& pdu = kRead, bool poll = false) {
        std::optional<Answer> got;
        bus->transact({.station = 17, .request = test::request_of(pdu), .client = 1, .poll = poll},
                      [&](Answer answer) { got = std::move(answer); });
        EXPECT_TRUE(test::run_until(io, clock, [&] { return got.has_value(); }));
        return got.value_or(Answer{});
    }
    void ask_often(int times) {
        for (int i = 0; i < times; ++i) ask();
    }
    /// Sends one request without a reply. Uses another function, so that its reply cannot stay
    /// outstanding for later requests.
    void fail() {
        line->reply.clear();
        ask("04 00 64 00 01"_hex);
        line->reply = kReply;
    }
    /// "1:timeout 2:late": ids and causes.
    std::string incidents() const {
        std::string text;
        for (const IncidentHead& one : bus->incidents())
            text += (text.empty() ? "" : " ") + std::to_string(one.id) + ':' + one.cause;
        return text;
    }

    boost::asio::io_context io{1};
    test::ManualClock clock;
    Settings settings;
    test::MemoryLine* line = nullptr;
    std::unique_ptr<Bus> bus;
};

TEST_F(BusTrace, ATransactionHasItsInstantsFramesClientAndReason) {
    bus->name_client(1, "http 10.0.0.9");
    const TimePoint asked = clock.now();
    const Answer answer = ask();
    EXPECT_EQ(answer.transactions.last(), 1u);
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
    ASSERT_TRUE(one.last_byte_in);
    EXPECT_GE(*one.last_byte_in, *one.first_byte_in);
    ASSERT_TRUE(one.answered);
    EXPECT_GE(*one.answered, *one.last_byte_in);
    const auto frames = bus->trace(9).frames;
    EXPECT_EQ(frames.at(0).sequence, one.first);
    EXPECT_EQ(frames.at(0).transaction, 1u);
    EXPECT_EQ(frames.at(1).transaction, 1u);
    EXPECT_GT(one.sequence, frames.at(1).sequence);
}

TEST_F(BusTrace, SaysWhatEachWasSentFor) {
    ask(kRead, true);
    ask("06 00 01 00 03"_hex);
    std::vector<std::string> reasons;
    for (const TraceTransaction& one : bus->trace(9).transactions) reasons.push_back(one.reason);
    EXPECT_THAT(reasons, testing::ElementsAre("poll", "write"));
}

TEST_F(BusTrace, FollowsByTheNumbersOfTheirEnds) {
    ask_often(3);
    const auto first = bus->trace_since(0, 1).transactions;
    ASSERT_EQ(first.size(), 1u);
    const auto rest = bus->trace_since(first[0].sequence, 9).transactions;
    ASSERT_EQ(rest.size(), 2u);
    EXPECT_EQ(rest[0].id, 2u);
    EXPECT_TRUE(bus->trace_since(rest[1].sequence, 9).transactions.empty());
}

TEST_F(BusTrace, OneThatGivesUpIsAnsweredByItsLastAttempt) {
    settings.arbiter.unlisted.retries = settings.arbiter.stations[0].retries = 1;
    make_bus();
    line->reply.clear();
    const Answer answer = ask();
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
    ask();
    fail();
    ask();
    clock.advance(11s);
    fail();
    EXPECT_EQ(incidents(), "1:timeout 2:timeout");
    EXPECT_TRUE(bus->incidents()[0].complete);
}

TEST_F(BusTrace, WhatWasReadGivesWayFirstAndThenTheOldest) {
    settings.incidents.incidents = 3;
    make_bus();
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

TEST_F(BusTrace, TheLossOfTheLineIsAnIncidentAndSoIsALateReply) {
    ask();
    line->events()->on_down("unplugged");
    EXPECT_EQ(incidents(), "1:line_down");
    EXPECT_FALSE(bus->incidents()[0].station);
    line->events()->on_down("unplugged");
    EXPECT_EQ(bus->incidents()[0].errors, 1u) << "it was down";
}

TEST_F(BusTrace, ALineThatWasNeverThereHasNone) {
    line->events()->on_down("no such device");
    EXPECT_EQ(incidents(), "");
}

TEST_F(BusTrace, ALongIncidentKeepsItsBeginning) {
    settings.incidents.each = {20, 128, 32, 8192, 4096};
    make_bus();
    ask_often(5);
    for (int i = 0; i < 50; ++i) fail();
    ASSERT_EQ(incidents(), "1:timeout");
    const auto incident = bus->incident(1);
    EXPECT_EQ(incident->part.transactions.size(), 20u);
    EXPECT_EQ(incident->part.transactions.front().id, 1u);
    EXPECT_TRUE(incident->head.complete);
}

}  // namespace
}  // namespace panelgate::bus::bus_trace_test
