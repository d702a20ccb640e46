#include <cstdint>
#include <string>
#include <string_view>

#include "loopback.hpp"
#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/framing.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::tcp_server::session_serial_test {
namespace {

using modbus::Framing;

/// Clients using RTU or ASCII over TCP: without transaction ids, only the order matches replies to
/// requests.
class SessionSerial : public Loopback, public ::testing::WithParamInterface<Framing> {
  protected:
    SessionSerial() { settings.framing = GetParam(); }
    static Bytes adu(std::uint8_t unit, const Bytes& pdu) {
        return modbus::encode_reply(GetParam(), 0, unit, pdu);
    }
    static void expect_next(Client& client, const Bytes& bytes) {
        ASSERT_EQ(client.receive_bytes(bytes.size()), bytes) << to_hex(bytes);
    }
    void do_all_that_is_due() {
        context.restart();
        while (context.poll() != 0) {
        }
    }
};
INSTANTIATE_TEST_SUITE_P(Framings, SessionSerial, ::testing::Values(Framing::rtu, Framing::ascii),
                         [](const auto& one) { return std::string(modbus::label(one.param)); });

TEST_P(SessionSerial, P3PipelinedRequestsAreAnsweredInTheirOrder) {
    start();
    Client client = connect();
    Bytes stream;
    for (std::uint16_t i = 0; i < 30; ++i) stream = stream + adu(1, read_pdu(i));
    client.send(stream);
    ASSERT_TRUE(run_until_pending(settings.in_flight));
    bus1.answer(1, reply_to_read(1));
    bus1.answer(0, reply_to_read(0));
    for (std::uint16_t i = 2; i < 30; ++i) {
        ASSERT_TRUE(run_until([&] { return !bus1.held.empty(); }));
        bus1.answer(0, reply_to_read(i));
    }
    for (std::uint16_t i = 0; i < 30; ++i) expect_next(client, adu(1, reply_to_read(i)));
    EXPECT_EQ(listener->counters().protocol_errors, 0U);
}

TEST_P(SessionSerial, AFaultIsAnExceptionInTheSameForm) {
    start();
    Client client = connect();
    client.send(adu(1, read_pdu(0)));
    ASSERT_TRUE(run_until_pending(1));
    bus1.answer(0, Fault::timeout);
    expect_next(client, adu(1, "83 0b"_hex));
    client.send(adu(248, read_pdu(0)));
    expect_next(client, adu(248, "83 0a"_hex));
    client.send(adu(2, "06 0000 0001"_hex));
    expect_next(client, adu(2, "86 01"_hex));
    client.send(adu(1, "03 0000 007E"_hex));
    expect_next(client, adu(1, "83 03"_hex));
}

TEST_P(SessionSerial, ABroadcastGetsNoReplyWhateverItsOutcome) {
    bus1.rights = {};
    start();
    Client client = connect();
    client.send(adu(0, "06 0000 0001"_hex) + adu(0, read_pdu(0)) + adu(1, read_pdu(1)));
    ASSERT_TRUE(run_until_pending(2));
    EXPECT_EQ(bus1.held[0].request.station, 0);
    bus1.answer(0, "06 0000 0001"_hex);
    bus1.answer(0, reply_to_read(1));
    expect_next(client, adu(1, reply_to_read(1)));
    client.send(adu(0, "06 0000 0001"_hex));
    ASSERT_TRUE(run_until_pending(1));
    bus1.answer(0, Fault::line_down, false);
    client.send(adu(255, "03 0001 0001"_hex));
    expect_next(client, adu(255, "03 02 0001"_hex));
}

TEST_P(SessionSerial, TheGatewayAnswersForItself) {
    start();
    Client client = connect();
    client.send(adu(255, "03 0001 0001"_hex));
    expect_next(client, adu(255, "03 02 0001"_hex));
}

TEST_P(SessionSerial, TakesRequestsByteByByte) {
    bus1.instant = reply_to_read(7);
    start();
    Client client = connect();
    for (const std::uint8_t byte : adu(1, read_pdu(7))) {
        client.send(Bytes{byte});
        do_all_that_is_due();
    }
    expect_next(client, adu(1, reply_to_read(7)));
}

TEST_P(SessionSerial, ADamagedRequestIsNotAnsweredAndClosesNothing) {
    bus1.instant = reply_to_read(7);
    start();
    Client client = connect();
    Bytes damaged = adu(1, read_pdu(7));
    damaged[5] ^= 0x01;
    client.send(damaged + adu(1, read_pdu(7)));
    ASSERT_TRUE(run_until([&] { return listener->counters().protocol_errors == 1; }));
    do_all_that_is_due();
    clock.advance(settings.rtu_silence);
    expect_next(client, adu(1, reply_to_read(7)));
    EXPECT_EQ(bus1.seen.size(), 1U);
    EXPECT_EQ(listener->counters().protocol_errors, 1U);
    EXPECT_EQ(listener->counters().connections, 1U);
}

TEST_P(SessionSerial, P9AClientThatSendsOnlyGarbageIsClosed) {
    bus1.instant = reply_to_read(1);
    start();
    Client bystander = connect();
    Client client = connect();
    client.send(Bytes(settings.garbage_limit + 600, 0x55));
    EXPECT_TRUE(client.sees_close());
    EXPECT_GE(log.count("no request in"), 1U);
    bystander.send(adu(1, read_pdu(1)));
    expect_next(bystander, adu(1, reply_to_read(1)));
}

TEST_P(SessionSerial, P3AHalfClosedClientGetsItsAnswers) {
    start();
    Client client = connect();
    client.send(adu(1, read_pdu(0)) + adu(1, read_pdu(1)));
    client.socket().shutdown(tcp::socket::shutdown_send);
    ASSERT_TRUE(run_until_pending(2));
    bus1.answer(0, reply_to_read(0));
    bus1.answer(0, reply_to_read(1));
    expect_next(client, adu(1, reply_to_read(0)));
    expect_next(client, adu(1, reply_to_read(1)));
    EXPECT_TRUE(client.sees_close());
}

TEST_P(SessionSerial, P2AClientThatLeavesCancelsItsRequests) {
    start();
    {
        Client client = connect();
        client.send(adu(1, "06 0000 0001"_hex));
        ASSERT_TRUE(run_until_pending(1));
        client.socket().set_option(asio::socket_base::linger(true, 0));
        client.socket().close();
    }
    EXPECT_TRUE(run_until([&] { return bus1.cancelled.size() == 1; }));
}

TEST_P(SessionSerial, TheLogNamesTheListenerAModbusTcpClientNeeds) {
    start();
    Client client = connect();
    client.request(1, 1, read_pdu(10));
    EXPECT_TRUE(client.sees_close());
    EXPECT_GE(log.count("it speaks Modbus/TCP and needs a listener with framing: tcp"), 1U);
    EXPECT_TRUE(bus1.seen.empty());
}

class SessionRtu : public Loopback {
  protected:
    SessionRtu() { settings.framing = Framing::rtu; }
};

TEST_F(SessionRtu, AStrayByteDoesNotStallTheConnection) {
    bus1.instant = reply_to_read(7);
    start();
    Client client = connect();
    // After a stray byte, unit 16 looks like a function code: a write whose length its data gives.
    const Bytes request = modbus::encode_adu(16, read_pdu(7));
    const Bytes reply = modbus::encode_adu(16, reply_to_read(7));
    for (unsigned stray = 0; stray < 256; ++stray) {
        client.send(Bytes{static_cast<std::uint8_t>(stray)} + request);
        ASSERT_TRUE(run_until([&] {
            if (clock.armed() != 0) clock.advance(settings.rtu_silence);
            return client.has_bytes(reply.size());
        })) << stray;
        ASSERT_EQ(client.receive_bytes(reply.size()), reply) << stray;
    }
    EXPECT_EQ(bus1.seen.size(), 256U);
    EXPECT_EQ(listener->counters().protocol_errors, 256U);
}

TEST_F(SessionRtu, P2AWriteInsideADamagedOneDoesNotReachTheBusAndTheNextOneDoes) {
    const Bytes pdu = "06 0000 BEEF"_hex;
    const Bytes inside = modbus::encode_adu(1, pdu);
    Bytes damaged = modbus::encode_adu(1, "10 0000 0005 0A 0007"_hex + inside);
    damaged.back() ^= 0x01;
    bus1.instant = pdu;
    start();
    Client client = connect();
    client.send(damaged);
    ASSERT_TRUE(run_until([&] { return listener->counters().protocol_errors > 0; }));
    clock.advance(settings.rtu_silence);
    EXPECT_TRUE(bus1.seen.empty());
    client.send(inside);
    ASSERT_TRUE(run_until([&] {
        if (clock.armed() != 0) clock.advance(settings.rtu_silence);
        return client.has_bytes(inside.size());
    }));
    EXPECT_EQ(client.receive_bytes(inside.size()), inside);
    EXPECT_EQ(bus1.seen.size(), 1U);
}

TEST_F(SessionRtu, AVendorsFunctionEndsByASilence) {
    bus1.instant = "41 07"_hex;
    start();
    Client client = connect();
    client.send(modbus::encode_adu(1, "41 01 02"_hex));
    ASSERT_TRUE(run_until_armed());
    EXPECT_TRUE(bus1.seen.empty());
    clock.advance(settings.rtu_silence);
    const Bytes reply = modbus::encode_adu(1, "41 07"_hex);
    EXPECT_EQ(client.receive_bytes(reply.size()), reply);
    EXPECT_EQ(bus1.seen.at(0).request.pdu(), "41 01 02"_hex);
}

TEST_F(SessionRtu, P3TheEndOfInputCountsAsASilence) {
    bus1.instant = "41 07"_hex;
    start();
    Client client = connect();
    client.send(modbus::encode_adu(1, "41 01 02"_hex));
    client.socket().shutdown(tcp::socket::shutdown_send);
    const Bytes reply = modbus::encode_adu(1, "41 07"_hex);
    EXPECT_EQ(client.receive_bytes(reply.size()), reply);
    EXPECT_TRUE(client.sees_close());
    EXPECT_EQ(listener->counters().protocol_errors, 0U);
}

TEST_F(SessionRtu, HalfARequestIsGivenUpAndTheConnectionLivesOn) {
    bus1.instant = reply_to_read(7);
    start();
    Client client = connect();
    client.send("01 03 00"_hex);
    ASSERT_TRUE(run_until_armed());
    clock.advance(settings.rtu_silence);
    ASSERT_TRUE(run_until_armed()) << "the silence was looked at; now the time of the request";
    clock.advance(settings.partial_adu_timeout);
    EXPECT_EQ(clock.armed(), 0U);
    client.send(modbus::encode_adu(1, read_pdu(7)));
    const Bytes reply = modbus::encode_adu(1, reply_to_read(7));
    EXPECT_EQ(client.receive_bytes(reply.size()), reply);
    EXPECT_EQ(listener->counters().protocol_errors, 1U);
}

class SessionAscii : public Loopback {
  protected:
    SessionAscii() { settings.framing = Framing::ascii; }
    static Bytes lower(Bytes text) {
        for (std::uint8_t& c : text) {
            if (c >= 'A' && c <= 'F') c = static_cast<std::uint8_t>(c + 32);
        }
        return text;
    }
};

TEST_F(SessionAscii, LowerCaseDigitsAreRefusedOrTaken) {
    bus1.instant = reply_to_read(0xAB);
    const Bytes request = lower(modbus::encode_ascii(1, "03 00AB 0001"_hex));
    start();
    Client strict = connect();
    strict.send(request);
    EXPECT_TRUE(run_until([&] { return listener->counters().protocol_errors == 1; }));
    EXPECT_TRUE(bus1.seen.empty());
    listener.reset();
    settings.ascii_digits = modbus::HexDigits::any_case;
    start();
    Client client = connect();
    client.send(request);
    const Bytes reply = modbus::encode_ascii(1, reply_to_read(0xAB));
    EXPECT_EQ(client.receive_bytes(reply.size()), reply) << "upper case all the same";
}

TEST_F(SessionAscii, ASecondBetweenCharactersIsAllowed) {
    bus1.instant = reply_to_read(7);
    start();
    Client client = connect();
    const Bytes request = modbus::encode_ascii(1, read_pdu(7));
    for (const std::uint8_t character : request) {
        client.send(Bytes{character});
        context.restart();
        context.poll();
        clock.advance(1s);
    }
    const Bytes reply = modbus::encode_ascii(1, reply_to_read(7));
    EXPECT_EQ(client.receive_bytes(reply.size()), reply);
}

class OnATcpListener : public Loopback, public ::testing::WithParamInterface<Framing> {};
INSTANTIATE_TEST_SUITE_P(Framings, OnATcpListener, ::testing::Values(Framing::rtu, Framing::ascii),
                         [](const auto& one) { return std::string(modbus::label(one.param)); });

TEST_P(OnATcpListener, AnotherFramingIsClosedBeforeAnythingReachesTheBus) {
    start();
    for (const Bytes& pdu : {"03 0000 0006"_hex, "03 0064 0005"_hex, "06 0000 0001"_hex}) {
        Client client = connect();
        const Bytes request = modbus::encode_reply(GetParam(), 0, 1, pdu);
        client.send(request + request);
        EXPECT_TRUE(client.sees_close());
        EXPECT_FALSE(client.has_input());
    }
    EXPECT_TRUE(bus1.seen.empty());
    EXPECT_EQ(listener->counters().protocol_errors, 3U);
    const std::string word(modbus::label(GetParam()));
    EXPECT_GE(log.count("needs a listener with framing: " + word), 1U);
}

class AnyListener : public Loopback, public ::testing::WithParamInterface<Framing> {};
INSTANTIATE_TEST_SUITE_P(Framings, AnyListener,
                         ::testing::Values(Framing::tcp, Framing::rtu, Framing::ascii),
                         [](const auto& one) { return std::string(modbus::label(one.param)); });

TEST_P(AnyListener, AnHttpClientIsClosedAndNamedInTheLog) {
    constexpr std::string_view kRequest = "GET /api/v1/lines HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";
    settings.framing = GetParam();
    start();
    Client client = connect();
    client.send(Bytes(kRequest.begin(), kRequest.end()));
    EXPECT_TRUE(client.sees_close());
    EXPECT_EQ(log.count("it speaks HTTP and needs the listener of 'http'"), 1U);
    EXPECT_TRUE(bus1.seen.empty());
}

}  // namespace
}  // namespace panelgate::tcp_server::session_serial_test
