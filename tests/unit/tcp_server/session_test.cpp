#include <algorithm>
#include <random>

#include "loopback.hpp"

namespace panelgate::tcp_server::session_test {
namespace {

class Session : public Loopback {};

TEST_F(Session, EchoesTransactionAndUnit) {
    settings.units[101] = {"floor1", 1};
    start();
    Client client = connect();
    client.request(0xBEEF, 101, read_pdu(5));
    ASSERT_TRUE(run_until_pending(1));
    EXPECT_EQ(bus1.held[0].request.station, 1);
    EXPECT_EQ(bus1.held[0].request.request.pdu(), read_pdu(5));
    EXPECT_NE(bus1.held[0].request.client, 0U);
    bus1.answer(0, reply_to_read(42));
    EXPECT_EQ(client.receive(), (modbus::Adu{0xBEEF, 101, reply_to_read(42)}));
}

TEST_F(Session, KeepsTheOrderWhenTheBusDoesNot) {
    start();
    Client client = connect();
    for (std::uint16_t i = 0; i < 8; ++i) client.request(i, 1, read_pdu(i));
    ASSERT_TRUE(run_until_pending(8));
    for (std::uint16_t i = 8; i-- > 1;) bus1.answer(i, reply_to_read(i));
    context.restart();
    context.poll();
    EXPECT_FALSE(client.has_input());
    bus1.answer(0, reply_to_read(0));
    for (std::uint16_t i = 0; i < 8; ++i) {
        EXPECT_EQ(client.receive(), (modbus::Adu{i, 1, reply_to_read(i)}));
    }
}

TEST_F(Session, DoesNotMindRepeatedTransactionIds) {
    start();
    Client client = connect();
    for (std::uint16_t i = 0; i < 4; ++i) client.request(0, 1, read_pdu(i));
    ASSERT_TRUE(run_until_pending(4));
    for (const std::uint8_t value : Bytes{3, 2, 1, 0}) bus1.answer(value, reply_to_read(value));
    for (std::uint16_t i = 0; i < 4; ++i) {
        EXPECT_EQ(client.receive(), (modbus::Adu{0, 1, reply_to_read(i)}));
    }
}

TEST_F(Session, KeepsTwoClientsWithEqualTransactionIdsApart) {
    start();
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

TEST_F(Session, TakesAdusByteByByteAndManyAtOnce) {
    bus1.instant = reply_to_read(1);
    start();
    Client client = connect();
    const Bytes adu = modbus::encode_mbap(1, 1, read_pdu(1));
    for (const std::uint8_t byte : adu) {
        client.send(ByteView(&byte, 1));
        context.restart();
        context.poll();
    }
    EXPECT_EQ(client.receive(), (modbus::Adu{1, 1, reply_to_read(1)}));
    client.send(adu + adu + adu);
    for (int i = 0; i < 3; ++i) EXPECT_EQ(client.receive()->pdu, reply_to_read(1));
}

TEST_F(Session, AnswersTheSameHoweverTheStreamIsCut) {
    bus1.instant = reply_to_read(9);
    settings.in_flight = 1000;
    settings.own_answers = 2000;  // the clock does not advance
    start();
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
        ByteView left(stream);
        while (!left.empty()) {
            const std::size_t n = std::min<std::size_t>(left.size(), 1 + chance() % 700);
            client.send(left.first(n));
            left = left.subspan(n);
            context.restart();
            context.poll();
        }
        for (const modbus::Adu& reply : expected) ASSERT_EQ(client.receive(), reply);
    }
    EXPECT_EQ(listener->counters().protocol_errors, 0U);
}

TEST_F(Session, RefusesFunctionsThatNoRequestMayCarry) {
    start();
    Client client = connect();
    EXPECT_EQ(client.ask(1, "00"_hex), "80 01"_hex);
    EXPECT_EQ(client.ask(1, "80 01"_hex), "80 01"_hex);
    EXPECT_EQ(client.ask(248, "ff"_hex), "ff 01"_hex) << "before routing";
    EXPECT_TRUE(bus1.seen.empty());
}

TEST_F(Session, RefusesUnroutedUnits) {
    settings.diagnostics_unit.reset();
    start();
    Client client = connect();
    for (const std::uint8_t unit : Bytes{248, 254, 255}) {
        EXPECT_EQ(client.ask(unit, read_pdu(0)), "83 0a"_hex);
        EXPECT_EQ(client.ask(unit, "03 00"_hex), "83 0a"_hex) << "before the form is judged";
    }
    EXPECT_TRUE(bus1.seen.empty());
}

TEST_F(Session, RefusesMalformedAndTooLargeRequests) {
    start();
    Client client = connect();
    EXPECT_EQ(client.ask(1, "03 0000"_hex), "83 03"_hex);
    EXPECT_EQ(client.ask(1, "03 0000 0001 00"_hex), "83 03"_hex);
    EXPECT_EQ(client.ask(1, "03 0000 007e"_hex), "83 03"_hex);
    EXPECT_EQ(client.ask(1, "01 0000 07d9"_hex), "81 03"_hex);
    EXPECT_EQ(client.ask(1, "10 0000 0002 02 0001"_hex), "90 03"_hex);
    EXPECT_TRUE(bus1.seen.empty());
}

TEST_F(Session, P3TurnsEveryFaultOfTheBusIntoItsException) {
    start();
    Client client = connect();
    const std::vector<std::pair<Fault, Bytes>> expected = {
        {Fault::denied, "83 01"_hex},    {Fault::malformed, "83 03"_hex},
        {Fault::busy, "83 06"_hex},      {Fault::expired, "83 06"_hex},
        {Fault::line_down, "83 0a"_hex}, {Fault::not_routed, "83 0a"_hex},
        {Fault::line_lost, "83 0b"_hex}, {Fault::timeout, "83 0b"_hex},
        {Fault::damaged, "83 0b"_hex},   {Fault::offline, "83 0b"_hex},
    };
    for (const auto& [fault, pdu] : expected) {
        EXPECT_EQ(ask_bus(client, 1, read_pdu(0), fault), pdu) << label(fault);
    }
}

TEST_F(Session, PassesRepliesAndExceptionsOfThePanelUnchanged) {
    start();
    Client client = connect();
    EXPECT_EQ(ask_bus(client, 1, read_pdu(0), "83 02"_hex), "83 02"_hex);
    EXPECT_EQ(ask_bus(client, 1, read_pdu(0), "83 c7"_hex), "83 c7"_hex);
    const Bytes large = "41"_hex + Bytes(252, 0xA5);
    EXPECT_EQ(ask_bus(client, 1, "41 01 02"_hex, large), large);
}

TEST_F(Session, NeverSendsAReplyThatNoFrameCanCarry) {
    start();
    Client client = connect();
    EXPECT_EQ(ask_bus(client, 1, "41"_hex, "41"_hex + Bytes(253, 0)), "c1 03"_hex);
    EXPECT_EQ(ask_bus(client, 1, "41"_hex, Bytes{}), "c1 03"_hex);
}

TEST_F(Session, HandsReadsAndWritesOverAsTheyAreAndNeverAsPolls) {
    bus1.instant = "00"_hex;
    start();
    Client client = connect();
    for (const Bytes& pdu : {read_pdu(0), "06 0000 0001"_hex, "41 00"_hex}) client.ask(1, pdu);
    ASSERT_EQ(bus1.seen.size(), 3U);
    EXPECT_TRUE(bus1.seen[0].request.is_read());
    EXPECT_FALSE(bus1.seen[1].request.is_read());
    EXPECT_FALSE(bus1.seen[2].request.is_read());
    for (const bus::Request& seen : bus1.seen) EXPECT_FALSE(seen.poll);
}

TEST_F(Session, RefusesWritesThroughAReadOnlyListener) {
    settings.read_only = true;
    bus1.instant = reply_to_read(0);
    start();
    Client client = connect();
    EXPECT_EQ(client.ask(1, "06 0000 0001"_hex), "86 01"_hex);
    EXPECT_EQ(client.ask(1, "41"_hex), "c1 01"_hex) << "nobody knows what it does";
    EXPECT_EQ(client.ask(0, "06 0000 0001"_hex), "86 01"_hex);
    EXPECT_EQ(client.ask(248, "06 0000 0001"_hex), "86 01"_hex) << "policy before routing";
    EXPECT_TRUE(bus1.seen.empty());
    EXPECT_EQ(client.ask(1, read_pdu(0)), reply_to_read(0));
}

TEST_F(Session, RefusesWritesToAReadOnlyStation) {
    bus1.instant = reply_to_read(0);
    start();
    Client client = connect();
    EXPECT_EQ(client.ask(2, "10 0000 0001 02 0001"_hex), "90 01"_hex);
    EXPECT_EQ(client.ask(2, "17 0000 0001 0000 0001 02 0001"_hex), "97 01"_hex);
    EXPECT_EQ(client.ask(2, "10 00"_hex), "90 01"_hex) << "policy before form";
    EXPECT_TRUE(bus1.seen.empty());
    EXPECT_EQ(client.ask(2, read_pdu(0)), reply_to_read(0));
}

TEST_F(Session, AnswersForItselfAtTheDiagnosticsUnit) {
    bus1.line.up = true;
    bus1.line.queue_depth = 5;
    start();
    Client client = connect();
    EXPECT_EQ(client.ask(255, "03 0000 0002"_hex), "03 04 0002 0001"_hex);
    EXPECT_EQ(client.ask(255, "04 0004 0002"_hex), "04 04 0001 0005"_hex);
    EXPECT_EQ(client.ask(255, "03 0007 0001"_hex), "03 02 0000"_hex);
    EXPECT_EQ(client.ask(255, "06 0000 0001"_hex), "86 01"_hex);
    EXPECT_EQ(client.ask(255, "2b 0e 04 02"_hex), "2b 0e 04 83 00 00 01 02 05 312e322e33"_hex);
    EXPECT_TRUE(bus1.seen.empty());
}

TEST_F(Session, PrefersAnAliasToTheDiagnosticsUnit) {
    settings.units[255] = {"floor1", 1};
    start();
    Client client = connect();
    EXPECT_EQ(ask_bus(client, 255, read_pdu(3), reply_to_read(3)), reply_to_read(3));
}

}  // namespace
}  // namespace panelgate::tcp_server::session_test
