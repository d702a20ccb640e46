#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "loopback.hpp"
#include "panelgate/modbus/framing.hpp"

namespace panelgate::tcp_server::session_serial_test {
namespace {

using modbus::Framing;

const auto kNameOf = [](const auto& one) { return std::string(modbus::label(one.param)); };

/// Clients using RTU or ASCII over TCP: without transaction ids, only the order matches replies to
/// requests.
class Serial : public Loopback {
  protected:
    explicit Serial(Framing framing) { settings.framing = framing; }
    Bytes adu(std::uint8_t unit, const Bytes& pdu) const {
        return modbus::encode_reply(settings.framing, 0, unit, pdu);
    }
    Bytes read_adu(std::uint16_t number) const { return adu(1, read_pdu(number)); }
    /// The client's next bytes are this reply.
    void expect_next(Client& client, std::uint8_t unit, const Bytes& pdu) {
        const Bytes bytes = adu(unit, pdu);
        ASSERT_EQ(client.receive_bytes(bytes.size()), bytes) << to_hex(bytes);
    }
    void expect_read(Client& client, std::uint16_t number) {
        expect_next(client, 1, reply_to_read(number));
    }
    /// The same, with a silence whenever something waits for one.
    void expect_next_after_silence(Client& client, std::uint8_t unit, const Bytes& pdu) {
        const std::size_t size = adu(unit, pdu).size();
        ASSERT_TRUE(run_until([&] {
            if (clock.armed() != 0) clock.advance(settings.rtu_silence);
            return client.has_bytes(size);
        }));
        expect_next(client, unit, pdu);
    }
};

class SessionSerial : public Serial, public ::testing::WithParamInterface<Framing> {
  protected:
    SessionSerial() : Serial(GetParam()) {}
};
INSTANTIATE_TEST_SUITE_P(Framings, SessionSerial, ::testing::Values(Framing::rtu, Framing::ascii),
                         kNameOf);

TEST_P(SessionSerial, P3PipelinedRequestsAreAnsweredInTheirOrder) {
    Client client = connect();
    Bytes stream;
    for (std::uint16_t i = 0; i < 30; ++i) stream = stream + read_adu(i);
    client.send(stream);
    ASSERT_TRUE(run_until_pending(settings.in_flight));
    bus1.answer(1, reply_to_read(1));
    bus1.answer(0, reply_to_read(0));
    for (std::uint16_t i = 2; i < 30; ++i) {
        ASSERT_TRUE(run_until([&] { return !bus1.held.empty(); }));
        bus1.answer(0, reply_to_read(i));
    }
    for (std::uint16_t i = 0; i < 30; ++i) expect_read(client, i);
    EXPECT_EQ(counters().protocol_errors, 0U);
}

TEST_P(SessionSerial, AFaultIsAnExceptionInTheSameFormAndTheGatewayAnswersForItself) {
    Client client = connect();
    client.send(read_adu(0));
    ASSERT_TRUE(run_until_pending(1));
    bus1.answer(0, Fault::timeout);
    expect_next(client, 1, "83 0b"_hex);
    client.send(adu(248, read_pdu(0)) + adu(2, "06 0000 0001"_hex) + adu(1, "03 0000 007E"_hex) +
                adu(255, "03 0001 0001"_hex));
    expect_next(client, 248, "83 0a"_hex);
    expect_next(client, 2, "86 01"_hex);
    expect_next(client, 1, "83 03"_hex);
    expect_next(client, 255, "03 02 0001"_hex);
}

TEST_P(SessionSerial, ABroadcastGetsNoReplyWhateverItsOutcome) {
    bus1.rights = {};
    Client client = connect();
    const Bytes write = adu(0, "06 0000 0001"_hex);
    client.send(write + adu(0, read_pdu(0)) + read_adu(1));
    ASSERT_TRUE(run_until_pending(2));
    EXPECT_EQ(bus1.held[0].request.station, 0);
    bus1.answer(0, "06 0000 0001"_hex);
    bus1.answer(0, reply_to_read(1));
    expect_read(client, 1);
    client.send(write);
    ASSERT_TRUE(run_until_pending(1));
    bus1.answer(0, Fault::line_down, false);
    client.send(adu(255, "03 0001 0001"_hex));
    expect_next(client, 255, "03 02 0001"_hex);
}

TEST_P(SessionSerial, ADamagedRequestIsNotAnsweredAndClosesNothing) {
    bus1.instant = reply_to_read(7);
    Client client = connect();
    Bytes damaged = read_adu(7);
    damaged[5] ^= 0x01;
    client.send(damaged + read_adu(7));
    ASSERT_TRUE(run_until_errors(1));
    do_all_that_is_due();
    clock.advance(settings.rtu_silence);
    expect_read(client, 7);
    EXPECT_EQ(bus1.seen.size(), 1U);
    EXPECT_EQ(counters().protocol_errors, 1U);
    EXPECT_EQ(counters().connections, 1U);
}

TEST_P(SessionSerial, P9AClientThatSendsOnlyGarbageIsClosed) {
    bus1.instant = reply_to_read(1);
    Client bystander = connect();
    Client client = connect();
    client.send(Bytes(settings.garbage_limit + 600, 0x55));
    EXPECT_TRUE(client.sees_close());
    EXPECT_GE(log.count("no request in"), 1U);
    bystander.send(read_adu(1));
    expect_read(bystander, 1);
}

TEST_P(SessionSerial, P3AHalfClosedClientGetsItsAnswers) {
    Client client = connect();
    client.send(read_adu(0) + read_adu(1));
    client.shutdown_send();
    ASSERT_TRUE(run_until_pending(2));
    bus1.answer(0, reply_to_read(0));
    bus1.answer(0, reply_to_read(1));
    expect_read(client, 0);
    expect_read(client, 1);
    EXPECT_TRUE(client.sees_close());
}

TEST_P(SessionSerial, P2AClientThatLeavesCancelsItsRequests) {
    Client client = connect();
    client.send(adu(1, "06 0000 0001"_hex));
    ASSERT_TRUE(run_until_pending(1));
    client.reset();
    EXPECT_TRUE(run_until([&] { return bus1.cancelled.size() == 1; }));
}

TEST_P(SessionSerial, TheLogNamesTheListenerAModbusTcpClientNeeds) {
    Client client = connect();
    client.read(10);
    EXPECT_TRUE(client.sees_close());
    EXPECT_GE(log.count("it speaks Modbus/TCP and needs a listener with framing: tcp"), 1U);
    EXPECT_TRUE(bus1.seen.empty());
}

class SessionRtu : public Serial {
  protected:
    SessionRtu() : Serial(Framing::rtu) {}
};

TEST_F(SessionRtu, AStrayByteDoesNotStallTheConnection) {
    bus1.instant = reply_to_read(7);
    Client client = connect();
    // After a stray byte, unit 16 looks like a function code: a write whose length its data gives.
    for (unsigned stray = 0; stray < 256; ++stray) {
        SCOPED_TRACE(stray);
        client.send(Bytes{static_cast<std::uint8_t>(stray)} + adu(16, read_pdu(7)));
        expect_next_after_silence(client, 16, reply_to_read(7));
        if (HasFatalFailure()) return;
    }
    EXPECT_EQ(bus1.seen.size(), 256U);
    EXPECT_EQ(counters().protocol_errors, 256U);
}

TEST_F(SessionRtu, P2AWriteInsideADamagedOneDoesNotReachTheBusAndTheNextOneDoes) {
    const Bytes pdu = "06 0000 BEEF"_hex;
    Bytes damaged = adu(1, "10 0000 0005 0A 0007"_hex + adu(1, pdu));
    damaged.back() ^= 0x01;
    bus1.instant = pdu;
    Client client = connect();
    client.send(damaged);
    ASSERT_TRUE(run_until([&] { return counters().protocol_errors > 0; }));
    clock.advance(settings.rtu_silence);
    EXPECT_TRUE(bus1.seen.empty());
    client.send(adu(1, pdu));
    expect_next_after_silence(client, 1, pdu);
    EXPECT_EQ(bus1.seen.size(), 1U);
}

TEST_F(SessionRtu, P3AVendorsFunctionEndsByASilenceAndTheEndOfInputCountsAsOne) {
    bus1.instant = "41 07"_hex;
    Client client = connect();
    client.send(adu(1, "41 01 02"_hex));
    ASSERT_TRUE(run_until_armed());
    EXPECT_TRUE(bus1.seen.empty());
    clock.advance(settings.rtu_silence);
    expect_next(client, 1, "41 07"_hex);
    EXPECT_EQ(bus1.seen.at(0).request.pdu(), "41 01 02"_hex);
    client.send(adu(1, "41 01 02"_hex));
    client.shutdown_send();
    expect_next(client, 1, "41 07"_hex);
    EXPECT_TRUE(client.sees_close());
    EXPECT_EQ(counters().protocol_errors, 0U);
}

TEST_F(SessionRtu, HalfARequestIsGivenUpAndTheConnectionLivesOn) {
    bus1.instant = reply_to_read(7);
    Client client = connect();
    client.send("01 03 00"_hex);
    ASSERT_TRUE(run_until_armed());
    clock.advance(settings.rtu_silence);
    ASSERT_TRUE(run_until_armed()) << "the silence was looked at; now the time of the request";
    clock.advance(settings.partial_adu_timeout);
    EXPECT_EQ(clock.armed(), 0U);
    client.send(read_adu(7));
    expect_read(client, 7);
    EXPECT_EQ(counters().protocol_errors, 1U);
}

TEST_F(SessionRtu, P3AWriteLongAfterNoiseThatAReadHasOutlivedIsTaken) {
    Client client = connect();
    bus1.instant = reply_to_read(7);
    client.send("F9 6C"_hex + read_adu(7));
    expect_next_after_silence(client, 1, reply_to_read(7));
    clock.advance(settings.partial_adu_timeout);
    const Bytes write = "06 0000 BEEF"_hex;
    bus1.instant = write;
    client.send(adu(1, write));
    expect_next(client, 1, write);
}

class SessionAscii : public Serial {
  protected:
    SessionAscii() : Serial(Framing::ascii) {}
};

TEST_F(SessionAscii, LowerCaseDigitsAreRefusedOrTaken) {
    bus1.instant = reply_to_read(0xAB);
    Bytes request = read_adu(0xAB);
    for (std::uint8_t& c : request)
        if (c >= 'A' && c <= 'F') c = static_cast<std::uint8_t>(c + 32);
    Client strict = connect();
    strict.send(request);
    EXPECT_TRUE(run_until_errors(1));
    EXPECT_TRUE(bus1.seen.empty());
    settings.ascii_digits = modbus::HexDigits::any_case;
    start();
    Client client = connect();
    client.send(request);
    expect_read(client, 0xAB);  // upper case all the same
}

TEST_F(SessionAscii, ASecondBetweenCharactersIsAllowed) {
    bus1.instant = reply_to_read(7);
    Client client = connect();
    for (const std::uint8_t character : read_adu(7)) {
        client.send(Bytes{character});
        do_all_that_is_due();
        clock.advance(1s);
    }
    expect_read(client, 7);
}

class OnATcpListener : public Loopback, public ::testing::WithParamInterface<Framing> {};
INSTANTIATE_TEST_SUITE_P(Framings, OnATcpListener, ::testing::Values(Framing::rtu, Framing::ascii),
                         kNameOf);

TEST_P(OnATcpListener, AnotherFramingIsClosedBeforeAnythingReachesTheBus) {
    for (const Bytes& pdu : {"03 0000 0006"_hex, "03 0064 0005"_hex, "06 0000 0001"_hex}) {
        Client client = connect();
        const Bytes request = modbus::encode_reply(GetParam(), 0, 1, pdu);
        client.send(request + request);
        EXPECT_TRUE(client.sees_close());
        EXPECT_FALSE(client.has_input());
    }
    EXPECT_TRUE(bus1.seen.empty());
    EXPECT_EQ(counters().protocol_errors, 3U);
    const std::string word(modbus::label(GetParam()));
    EXPECT_GE(log.count("needs a listener with framing: " + word), 1U);
}

class AnyListener : public Loopback, public ::testing::WithParamInterface<Framing> {};
INSTANTIATE_TEST_SUITE_P(Framings, AnyListener,
                         ::testing::Values(Framing::tcp, Framing::rtu, Framing::ascii), kNameOf);

TEST_P(AnyListener, AnHttpClientIsClosedAndNamedInTheLog) {
    constexpr std::string_view kRequest = "GET /api/v1/lines HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";
    settings.framing = GetParam();
    Client client = connect();
    client.send(Bytes(kRequest.begin(), kRequest.end()));
    EXPECT_TRUE(client.sees_close());
    EXPECT_EQ(log.count("it speaks HTTP and needs the listener of 'http'"), 1U);
    EXPECT_TRUE(bus1.seen.empty());
}

TEST_P(AnyListener, ATlsClientIsClosedAndNamedInTheLog) {
    settings.framing = GetParam();
    Client client = connect();
    client.send("16 03 01 00 2c 01 00 00 28 03 03"_hex + Bytes(38, 0x5A));
    EXPECT_TRUE(client.sees_close());
    EXPECT_EQ(log.count("it speaks TLS and needs a listener with tls"), 1U);
    EXPECT_TRUE(bus1.seen.empty());
}

}  // namespace
}  // namespace panelgate::tcp_server::session_serial_test
