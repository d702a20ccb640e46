#include "panelgate/ethernet/ethernet.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>
#include <variant>

#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/request.hpp"

namespace panelgate::ethernet {
namespace {

using arbiter::Action;
using arbiter::Finish;
using arbiter::Job;
using arbiter::Ticket;
using modbus::Adu;
using test::request_of;
using testing::ElementsAre;

constexpr Duration kTimeout = 500ms;
constexpr Duration kAfter = kTimeout + 1ms;

/// A device with the units 1 and 2, and what it was sent.
class EthernetTest : public testing::Test {
  protected:
    static arbiter::Settings settings_of(unsigned in_flight) {
        arbiter::Settings settings;
        settings.serial.baud = SerialFormat::kNoWire;
        settings.in_flight = in_flight;
        settings.share_reads = false;
        for (const std::uint8_t id : {std::uint8_t{1}, std::uint8_t{2}}) {
            arbiter::StationSettings station;
            station.id = id;
            station.response_timeout = kTimeout;
            station.retries = 0;
            settings.stations.push_back(station);
        }
        return settings;
    }
    explicit EthernetTest(unsigned in_flight = 4) : machine(settings_of(in_flight)) {
        machine.on_line_up(now);
        drain();
    }

    /// A read of another address each time.
    Result<Ticket> read(std::uint8_t station, arbiter::Client client = 1) {
        return submit(station,
                      modbus::encode_read(modbus::Table::holding_registers,
                                          static_cast<std::uint16_t>(address++), 1),
                      client);
    }
    Result<Ticket> write(std::uint8_t station, arbiter::Client client = 1) {
        return submit(station, modbus::encode_write_register(7, 1), client);
    }
    Result<Ticket> submit(std::uint8_t station, const Bytes& pdu, arbiter::Client client) {
        modbus::Request request = request_of(pdu);
        const bool is_read = request.is_read();
        const auto ticket =
            machine.submit(now, {.station = station,
                                 .request = std::move(request),
                                 .client = client,
                                 .priority = is_read ? PriorityClass::read : PriorityClass::write});
        drain();
        return ticket;
    }

    void drain() {
        while (auto action = machine.poll_action()) {
            if (auto* sent = std::get_if<arbiter::Transmit>(&*action)) hear(sent->adu);
            if (auto* finish = std::get_if<Finish>(&*action)) {
                EXPECT_FALSE(ended.contains(finish->ticket)) << "one answer a request";
                ended.emplace(finish->ticket, *finish);
            }
            if (std::holds_alternative<arbiter::Reset>(*action)) ++resets;
            if (auto* event = std::get_if<arbiter::StationEvent>(&*action))
                events.push_back(*event);
        }
    }
    void hear(const Bytes& wire) {
        framer.feed(wire);
        while (const auto event = framer.next()) wires.push_back(std::get<Adu>(*event));
    }

    /// The device's reply to what it was sent as number `which`.
    static Adu reply_to(const Adu& request) {
        if (request.pdu[0] == 6) return request;
        return {
            request.transaction, request.unit, {request.pdu[0], 2, request.pdu[1], request.pdu[2]}};
    }
    void answer(std::size_t which) { come(reply_to(wires[which])); }
    void come(const Adu& adu) {
        machine.on_rx(now, modbus::encode_mbap(adu.transaction, adu.unit, adu.pdu));
        drain();
    }
    void wait(Duration duration) {
        const TimePoint until = now + duration;
        while (true) {
            const auto next = machine.next_deadline();
            if (!next || *next > until) break;
            now = std::max(now, *next);
            machine.on_deadline(now);
            drain();
            ASSERT_LT(++rings, 10'000) << "an alarm that changes nothing";
        }
        now = until;
        machine.on_deadline(now);
        drain();
    }
    Result<Bytes> end_of(const Result<Ticket>& ticket) const { return ended.at(*ticket).pdu; }
    bool is_open(const Result<Ticket>& ticket) const { return !ended.contains(*ticket); }

    TimePoint now{1h};
    Ethernet machine;
    modbus::MbapFramer framer;
    std::vector<Adu> wires;
    std::map<Ticket, Finish> ended;
    std::vector<arbiter::StationEvent> events;
    unsigned address = 0;
    int resets = 0;
    int rings = 0;
};

TEST_F(EthernetTest, SoManyReadsAreOnTheirWayAtOnceAndTheirIdsTellTheReplies) {
    std::vector<Result<Ticket>> tickets;
    for (int i = 0; i < 6; ++i) tickets.push_back(read(1));
    EXPECT_EQ(wires.size(), 4U);
    answer(2);
    EXPECT_EQ(*end_of(tickets[2]), (Bytes{3, 2, 0, 2}));
    EXPECT_EQ(wires.size(), 5U) << "its place is free";
    for (const std::size_t which : {4U, 0U, 3U, 1U}) answer(which);
    for (std::size_t i = 0; i < 5; ++i)
        EXPECT_EQ((*end_of(tickets[i]))[3], i) << "each its own value";
    answer(5);
    EXPECT_EQ(ended.size(), 6U);
    std::set<std::uint16_t> ids;
    for (const Adu& adu : wires) ids.insert(adu.transaction);
    EXPECT_EQ(ids.size(), 6U);
    EXPECT_TRUE(machine.idle());
}

TEST_F(EthernetTest, AWriteIsAloneAtItsStationAndReadsDoNotPassIt) {
    read(1);
    const auto writes = write(1);
    const auto behind = read(1);
    const auto other = read(2);
    ASSERT_EQ(wires.size(), 2U) << "the first read, and that of the other station";
    answer(0);
    ASSERT_EQ(wires.size(), 3U);
    EXPECT_EQ(wires[2].pdu[0], 6);
    EXPECT_TRUE(is_open(behind));
    answer(2);
    ASSERT_EQ(wires.size(), 4U);
    answer(3);
    EXPECT_TRUE(end_of(writes).has_value());
    EXPECT_TRUE(end_of(behind).has_value());
    EXPECT_TRUE(is_open(other));
}

TEST_F(EthernetTest, AnEarlierReplyAnswersNothing) {
    const auto first = read(1);
    wait(kAfter);
    EXPECT_EQ(end_of(first).error(), Fault::timeout);
    const auto second = read(1);
    answer(0);
    EXPECT_TRUE(is_open(second));
    ASSERT_FALSE(events.empty());
    EXPECT_EQ(events.back().kind, arbiter::StationEvent::Kind::late);
    answer(1);
    EXPECT_EQ((*end_of(second))[3], 1);
    answer(1);  // once more
    EXPECT_EQ(ended.size(), 2U);
}

TEST_F(EthernetTest, WhatDoesNotFitTheRequestIsNoAnswer) {
    const auto unit = read(1);
    come({wires[0].transaction, 2, {3, 2, 0, 0}});
    EXPECT_TRUE(is_open(unit)) << "another unit's reply is nobody's";
    answer(0);
    EXPECT_TRUE(end_of(unit).has_value());
    const auto function = read(1);
    come({wires[1].transaction, 1, {4, 2, 0, 0}});
    EXPECT_EQ(end_of(function).error(), Fault::wrong);
    const auto count = read(1);
    come({wires[2].transaction, 1, {3, 4, 0, 0, 0, 0}});
    EXPECT_EQ(end_of(count).error(), Fault::wrong);
    come({4711, 1, {3, 2, 0, 0}});
    EXPECT_EQ(ended.size(), 3U);
}

TEST_F(EthernetTest, APanelsExceptionIsItsAnswerAndAFarGatewaysIsSilence) {
    const auto refused = read(1);
    come({wires[0].transaction, 1, {0x83, 2}});
    EXPECT_EQ(*end_of(refused), (Bytes{0x83, 2}));
    const auto dead = read(1);
    come({wires[1].transaction, 1, {0x83, 0x0B}});
    EXPECT_EQ(end_of(dead).error(), Fault::timeout);
}

TEST_F(EthernetTest, ADeadUnitHasOnePlaceSoThatTheOthersGoOn) {
    for (int i = 0; i < 4; ++i) read(1);
    wait(kAfter);  // nothing came: it is a suspect
    const auto asked = wires.size();
    for (int i = 0; i < 4; ++i) read(1);
    const auto alive = read(2);
    EXPECT_LE(wires.size(), asked + 2);
    ASSERT_EQ(wires.back().unit, 2);
    come(reply_to(wires.back()));
    EXPECT_TRUE(end_of(alive).has_value());
    wait(10 * kTimeout);
    EXPECT_EQ(machine.health(1).state(), Health::offline);
    EXPECT_EQ(read(1).error(), Fault::offline);
}

TEST_F(EthernetTest, ABroadcastIsSentAndAnsweredAtOnce) {
    const auto all = write(0);
    ASSERT_EQ(wires.size(), 1U);
    EXPECT_EQ(wires[0].unit, 0);
    EXPECT_EQ(*end_of(all), wires[0].pdu);
    come(wires[0]);  // some devices answer unit 0
    EXPECT_EQ(ended.size(), 1U);
}

TEST_F(EthernetTest, ALostConnectionEndsWhatIsOnItsWayAndWhatWaits) {
    std::vector<Result<Ticket>> tickets;
    for (int i = 0; i < 5; ++i) tickets.push_back(read(1));
    machine.on_line_down(now);
    drain();
    EXPECT_EQ(end_of(tickets[0]).error(), Fault::line_lost);
    EXPECT_EQ(end_of(tickets[4]).error(), Fault::line_down);
    EXPECT_EQ(read(1).error(), Fault::line_down);
    machine.on_line_up(now);
    const auto again = read(1);
    answer(0);
    EXPECT_TRUE(is_open(again)) << "the reply of the lost connection";
    answer(4);
    EXPECT_TRUE(end_of(again).has_value());
}

TEST_F(EthernetTest, BytesThatAreNoModbusTcpMakeANewConnection) {
    const auto waits = read(1);
    machine.on_rx(now, Bytes{0, 1, 0, 0, 0xFF, 0xFF, 1, 3});
    drain();
    EXPECT_EQ(resets, 1);
    EXPECT_TRUE(is_open(waits));
    machine.on_line_down(now);
    drain();
    EXPECT_EQ(end_of(waits).error(), Fault::line_lost);
}

TEST_F(EthernetTest, ACancelledClientsRequestsAreNotSent) {
    for (int i = 0; i < 4; ++i) read(1, 1);
    const auto waits = read(1, 2);
    machine.cancel(now, 2);
    drain();
    EXPECT_EQ(end_of(waits).error(), Fault::cancelled);
    machine.cancel(now, 1);
    drain();
    for (std::size_t i = 0; i < 4; ++i) answer(i);
    EXPECT_EQ(wires.size(), 4U);
}

TEST_F(EthernetTest, TimeOfRequestsAtTheSameTimeCountsOnce) {
    for (int i = 0; i < 4; ++i) read(1);
    now += 100ms;
    for (std::size_t i = 0; i < 4; ++i) answer(i);
    EXPECT_EQ(machine.counters().busy, 100ms);
}

TEST_F(EthernetTest, OneInFlightIsOne) {
    Ethernet one(settings_of(1));
    one.on_line_up(now);
    int sent = 0;
    for (int i = 0; i < 3; ++i) {
        EXPECT_TRUE(one.submit(now, {.station = 1, .request = request_of(Bytes{3, 0, 0, 0, 1})}));
        while (const auto action = one.poll_action())
            sent += std::holds_alternative<arbiter::Transmit>(*action) ? 1 : 0;
    }
    EXPECT_EQ(sent, 1);
}

/// Replies that are dropped, late, doubled, of another unit or number: each request has one answer,
/// and no answer has another request's value.
TEST_F(EthernetTest, AnythingMayHappenToReplies) {
    std::mt19937 random(20261130);
    const auto dice = [&](unsigned sides) { return static_cast<unsigned>(random() % sides); };
    std::map<Ticket, std::uint16_t> asked;
    std::vector<Adu> kept;
    std::size_t seen = 0;
    for (int round = 0; round < 20'000; ++round) {
        const auto station = static_cast<std::uint8_t>(1 + dice(2));
        const auto value = static_cast<std::uint16_t>(address);
        if (const auto ticket = dice(10) == 0 ? write(station) : read(station); ticket)
            asked[*ticket] = value;
        for (; seen < wires.size(); ++seen) kept.push_back(reply_to(wires[seen]));
        for (unsigned i = dice(4); i > 0 && !kept.empty(); --i) {
            const std::size_t which = dice(static_cast<unsigned>(kept.size()));
            Adu reply = kept[which];
            const unsigned fault = dice(12);
            if (fault == 0) reply.unit = static_cast<std::uint8_t>(3 - reply.unit);
            if (fault == 1) reply.transaction = static_cast<std::uint16_t>(random());
            if (fault != 2) kept.erase(kept.begin() + static_cast<std::ptrdiff_t>(which));
            if (fault != 3) come(reply);
        }
        if (kept.size() > 50) kept.erase(kept.begin(), kept.begin() + 25);
        wait(std::chrono::milliseconds(dice(60)));
        rings = 0;
    }
    wait(1min);
    std::size_t good = 0;
    for (const auto& [ticket, value] : asked) {
        ASSERT_TRUE(ended.contains(ticket));
        const Result<Bytes>& pdu = ended.at(ticket).pdu;
        if (!pdu || (*pdu)[0] != 3) continue;
        ++good;
        EXPECT_EQ((*pdu)[2] << 8 | (*pdu)[3], value);
    }
    EXPECT_GT(good, 1000U);
}

}  // namespace
}  // namespace panelgate::ethernet
