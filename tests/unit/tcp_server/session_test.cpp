#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <tuple>
#include <utility>
#include <vector>

#include "loopback.hpp"

namespace panelgate::tcp_server::session_test {
namespace {

class Session : public Loopback {};

TEST_F(Session, EchoesTransactionAndUnit) {
    settings.units[101] = {"floor1", 1};
    Client client = connect();
    client.request(0xBEEF, 101, read_pdu(5));
    ASSERT_TRUE(run_until_pending(1));
    EXPECT_EQ(bus1.held[0].request.station, 1);
    EXPECT_EQ(bus1.held[0].request.request.pdu(), read_pdu(5));
    EXPECT_NE(bus1.held[0].request.client, 0U);
    EXPECT_FALSE(bus1.held[0].request.poll);
    bus1.answer(0, reply_to_read(42));
    EXPECT_EQ(client.receive(), (modbus::Adu{0xBEEF, 101, reply_to_read(42)}));
}

TEST_F(Session, KeepsTheOrderWhenTheBusDoesNotAlsoWhereTransactionIdsAreTheSame) {
    for (const bool same : {false, true}) {
        const auto id = [&](std::uint16_t i) { return same ? std::uint16_t{0} : i; };
        Client client = connect();
        for (std::uint16_t i = 0; i < 8; ++i) client.request(id(i), 1, read_pdu(i));
        ASSERT_TRUE(run_until_pending(8));
        for (std::uint16_t i = 8; i-- > 1;) bus1.answer(i, reply_to_read(i));
        do_all_that_is_due();
        EXPECT_FALSE(client.has_input());
        bus1.answer(0, reply_to_read(0));
        for (std::uint16_t i = 0; i < 8; ++i)
            EXPECT_EQ(client.receive(), (modbus::Adu{id(i), 1, reply_to_read(i)}));
    }
}

TEST_F(Session, KeepsTwoClientsWithEqualTransactionIdsApart) {
    Client first = connect();
    Client second = connect();
    first.request(1, 1, read_pdu(10));
    ASSERT_TRUE(run_until_pending(1));
    second.request(1, 1, read_pdu(20));
    ASSERT_TRUE(run_until_pending(2));
    EXPECT_NE(bus1.held[0].request.client, bus1.held[1].request.client);
    bus1.answer(1, reply_to_read(20));
    bus1.answer(0, reply_to_read(10));
    EXPECT_EQ(first.receive()->pdu, reply_to_read(10));
    EXPECT_EQ(second.receive()->pdu, reply_to_read(20));
}

TEST_F(Session, AnswersTheSameHoweverTheStreamIsCut) {
    bus1.instant = reply_to_read(9);
    settings.in_flight = 1000;
    settings.own_answers = 2000;  // the clock does not advance
    std::mt19937 chance(20261121);
    Bytes stream;
    std::vector<modbus::Adu> expected;
    for (std::uint16_t i = 0; i < 300; ++i) {
        const bool good = chance() % 3 != 0;
        const Bytes pdu = good ? read_pdu(i) : "41 00"_hex + Bytes(chance() % 250, 0x55);
        const std::uint8_t unit = chance() % 4 == 0 ? 248 : 1;
        stream = stream + modbus::encode_mbap(i, unit, pdu);
        const Bytes refused = {static_cast<std::uint8_t>(pdu[0] | 0x80), 0x0A};
        expected.push_back({i, unit, unit == 1 ? reply_to_read(9) : refused});
    }
    for (int round = 0; round < 5; ++round) {
        Client client = connect();
        for (ByteView left(stream); !left.empty();) {
            const std::size_t most = round == 0 ? 20 : 700;
            const std::size_t n = std::min(left.size(), 1 + chance() % most);
            client.send(left.first(n));
            left = left.subspan(n);
            do_all_that_is_due();
        }
        for (const modbus::Adu& reply : expected) ASSERT_EQ(client.receive(), reply);
    }
    EXPECT_EQ(counters().protocol_errors, 0U);
}

// Which requests are refused, and in which order of rules: dispatch_test.
TEST_F(Session, AnswersWhatNeedsNoLineByItself) {
    bus1.line.up = true;
    bus1.line.queue_depth = 5;
    settings.own_answers = 100;  // the clock does not advance
    const std::tuple<std::uint8_t, Bytes, Bytes> rows[] = {
        {248, "ff"_hex, "ff 01"_hex},             // no request may carry it
        {248, "03 00"_hex, "83 0a"_hex},          // an unrouted unit
        {1, "03 0000 0001 00"_hex, "83 03"_hex},  // malformed
        {1, "03 0000 007e"_hex, "83 03"_hex},     // too large
        {1, "01 0000 07d9"_hex, "81 03"_hex},     // too large
        {2, "10 00"_hex, "90 01"_hex},            // a write to a read-only station
        {0, "17 0000 0001 0000 0001 02 0001"_hex, "97 01"_hex},
        {255, "03 0000 0002"_hex, "03 04 0002 0001"_hex},
        {255, "04 0004 0002"_hex, "04 04 0001 0005"_hex},
        {255, "03 0007 0001"_hex, "03 02 0000"_hex},
        {255, "06 0000 0001"_hex, "86 01"_hex},
        {255, "2b 0e 04 02"_hex, "2b 0e 04 82 00 00 01 02 05 312e322e33"_hex},
    };
    Client client = connect();
    for (const auto& [unit, request, reply] : rows)
        EXPECT_EQ(client.ask(unit, request), reply) << int{unit} << ": " << to_hex(request);
    settings.read_only = true;
    start();
    Client reader = connect();
    EXPECT_EQ(reader.ask(1, "06 0000 0001"_hex), "86 01"_hex);
    EXPECT_TRUE(bus1.seen.empty());
    EXPECT_EQ(ask_bus(reader, 2, read_pdu(0), reply_to_read(0)), reply_to_read(0));
}

TEST_F(Session, P3TurnsEveryFaultOfTheBusIntoItsException) {
    Client client = connect();
    const std::vector<std::pair<Fault, Bytes>> expected = {
        {Fault::denied, "83 01"_hex},    {Fault::malformed, "83 03"_hex},
        {Fault::busy, "83 06"_hex},      {Fault::expired, "83 06"_hex},
        {Fault::line_down, "83 0a"_hex}, {Fault::not_routed, "83 0a"_hex},
        {Fault::line_lost, "83 0b"_hex}, {Fault::timeout, "83 0b"_hex},
        {Fault::damaged, "83 0b"_hex},   {Fault::offline, "83 0b"_hex},
        {Fault::wrong, "83 0b"_hex},
    };
    for (const auto& [fault, pdu] : expected)
        EXPECT_EQ(ask_bus(client, 1, read_pdu(0), fault), pdu) << label(fault);
}

TEST_F(Session, PassesRepliesAndExceptionsOfThePanelUnchangedIfAFrameCanCarryThem) {
    Client client = connect();
    const Bytes large = "41"_hex + Bytes(252, 0xA5);
    for (const Bytes& reply : {"83 02"_hex, "83 c7"_hex, large})
        EXPECT_EQ(ask_bus(client, 1, reply == large ? "41 01 02"_hex : read_pdu(0), reply), reply);
    EXPECT_EQ(ask_bus(client, 1, "41"_hex, "41"_hex + Bytes(253, 0)), "c1 03"_hex);
    EXPECT_EQ(ask_bus(client, 1, "41"_hex, Bytes{}), "c1 03"_hex);
}

const Bytes kWrite = "10 0064 0001 02 00ff"_hex;
const Bytes kWritten = "10 0064 0001"_hex;

// TBC-02 to TBC-06.
class SessionBroadcast : public Loopback {
  protected:
    SessionBroadcast() { bus1.rights = {}; }
    /// Broadcasts on two lines.
    void broadcast(Client& client) {
        client.request(1, 0, kWrite);
        ASSERT_TRUE(run_until([&] { return bus1.held.size() + bus2.held.size() == 2; }));
    }
};

TEST_F(SessionBroadcast, AnswersABroadcastAsSoonAsItHasLeft) {
    Client client = connect();
    client.request(1, 0, kWrite);
    ASSERT_TRUE(run_until_pending(1));
    EXPECT_EQ(bus1.held[0].request.station, 0);
    EXPECT_FALSE(bus1.held[0].request.request.is_read());
    bus1.answer(0, kWritten);
    EXPECT_EQ(client.receive(), (modbus::Adu{1, 0, kWritten}));
    EXPECT_TRUE(bus2.seen.empty()) << "a line of another listener";
}

TEST_F(SessionBroadcast, RefusesAnythingButAWriteToUnitZeroAndEverythingWhereItIsDenied) {
    Client client = connect();
    EXPECT_EQ(client.ask(0, read_pdu(0)), "83 0a"_hex);
    EXPECT_EQ(client.ask(0, "06 0000"_hex), "86 03"_hex);
    settings.broadcast = BroadcastMode::deny;
    start();
    Client denied = connect();
    EXPECT_EQ(denied.ask(0, kWrite), "90 01"_hex);
    EXPECT_TRUE(bus1.seen.empty());
}

TEST_F(SessionBroadcast, WaitsForTheLastOfSeveralLinesAndTellsWhatBecameOfIt) {
    settings.lines = {"floor1", "floor2"};
    Client client = connect();
    broadcast(client);
    bus2.answer(0, kWritten);
    do_all_that_is_due();
    EXPECT_FALSE(client.has_input());
    bus1.answer(0, Fault::line_down, false);
    EXPECT_EQ(client.receive()->pdu, kWritten) << "a line that is down stops nobody";
    Client second = connect();
    broadcast(second);
    bus1.answer(0, Fault::line_down, false);
    bus2.answer(0, Fault::line_lost, true);
    EXPECT_EQ(second.receive()->pdu, "90 0b"_hex) << "it may have been sent";
    for (const BroadcastMode mode : {BroadcastMode::reply, BroadcastMode::silent}) {
        settings.broadcast = mode;
        start();
        Client another = connect();
        broadcast(another);
        bus1.answer(0, Fault::line_down, false);
        bus2.answer(0, Fault::line_down, false);
        EXPECT_EQ(another.receive()->pdu, "90 0a"_hex) << "no line could send it";
    }
}

TEST_F(SessionBroadcast, KeepsSilentWhenItIsAskedTo) {
    settings.broadcast = BroadcastMode::silent;
    settings.in_flight = 2;
    Client client = connect();
    client.request(1, 0, kWrite);
    read(client, 2, 2);
    bus1.answer(1, reply_to_read(2));
    bus1.answer(0, kWritten);
    EXPECT_EQ(client.receive(), read_reply(2));
    EXPECT_EQ(client.ask(0, "06 0000"_hex), "86 03"_hex) << "what is known before is told";
    EXPECT_EQ(client.ask(0, read_pdu(0)), "83 0a"_hex);
    client.read(3);
    read(client, 4, 2);  // the silent one's place is free again
}

// Framing errors: MBAP-05 to MBAP-07.
class SessionFraming : public Loopback {
  protected:
    SessionFraming() { bus1.instant = reply_to_read(1); }
};

TEST_F(SessionFraming, SkipsAnotherProtocolAndServesTheNextRequest) {
    Client client = connect();
    const Bytes foreign = "0001 0001 0006 01 03 0000 0001"_hex;
    client.send(foreign + foreign);
    EXPECT_TRUE(is_served(client));
    EXPECT_EQ(counters().protocol_errors, 2U);
    client.send(foreign + foreign);
    EXPECT_TRUE(is_served(client)) << "a good one in between starts anew";
    client.send(foreign + foreign + foreign);
    EXPECT_TRUE(client.sees_close());
    EXPECT_EQ(counters().protocol_errors, 7U);
}

TEST_F(SessionFraming, ABadLengthClosesOnlyThatConnectionAndTheShortestAndLongestAreGood) {
    Client bystander = connect();
    std::uint64_t errors = 0;
    for (const unsigned length : {0u, 1u, 255u, 65535u}) {
        Client client = connect();
        client.send(Writer().u16(1).u16(0).u16(length).u8(1).u8(3).take());
        EXPECT_TRUE(client.sees_close()) << length;
        EXPECT_FALSE(client.has_input()) << "closed without a reply";
        EXPECT_EQ(counters().protocol_errors, ++errors);
        EXPECT_TRUE(is_served(bystander));
        EXPECT_EQ(counters().connections, 1U);
    }
    EXPECT_EQ(bystander.ask(1, "07"_hex), *bus1.instant);
    EXPECT_EQ(bystander.ask(1, "41"_hex + Bytes(252, 1)), *bus1.instant);
    EXPECT_EQ(bus1.seen.back().request.pdu().size(), 253U);
}

TEST_F(SessionFraming, ClosesAConnectionThatSendsHalfAnAdu) {
    Client idle = connect();
    Client client = connect();
    client.send("0001 0000"_hex);
    ASSERT_TRUE(run_until_armed());
    clock.advance(settings.partial_adu_timeout - 1ns);
    EXPECT_EQ(counters().protocol_errors, 0U);
    clock.advance(1ns);
    EXPECT_TRUE(client.sees_close());
    EXPECT_EQ(counters().protocol_errors, 1U);
    EXPECT_TRUE(is_served(idle)) << "silence alone is no fault";
}

TEST_F(SessionFraming, DoesNotLetDribblingBytesStretchTheTime) {
    settings.partial_adu_timeout = 50ms;
    Client client = connect();
    client.send("0001 0000 00fe 01"_hex);
    ASSERT_TRUE(run_until_armed());
    const auto end = clock.next();
    // Sending all 260 bytes would take far longer than an ADU is allowed.
    for (int i = 0; i < 9; ++i) {
        client.send("41"_hex);
        do_all_that_is_due();
        clock.advance(5ms);
        ASSERT_EQ(clock.next(), end);
    }
    clock.advance(5ms);
    EXPECT_EQ(counters().protocol_errors, 1U);
    EXPECT_TRUE(client.sees_close());
    EXPECT_TRUE(bus1.seen.empty());
}

TEST_F(SessionFraming, TheNextAduHasATimeOfItsOwn) {
    Client client = connect();
    client.send("0001 0000"_hex);
    ASSERT_TRUE(run_until_armed());
    const auto first = clock.next();
    clock.advance(1ms);
    client.send("0006 01 03 0000 0001 0002"_hex);  // its rest and the start of the next
    EXPECT_EQ(client.receive()->pdu, reply_to_read(1));
    ASSERT_TRUE(clock.next());
    EXPECT_EQ(*clock.next() - *first, 1ms);
}

}  // namespace
}  // namespace panelgate::tcp_server::session_test
