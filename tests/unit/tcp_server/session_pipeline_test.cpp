#include <gmock/gmock.h>

#include <algorithm>
#include <cstdint>

#include "loopback.hpp"

namespace panelgate::tcp_server::session_pipeline_test {
namespace {

// Clients that pipeline requests: PIP-01 to PIP-07.
class SessionPipeline : public Loopback {
  protected:
    /// Requests are identified by their addresses; one segment, so the server has all or none of
    /// it.
    static Bytes reads(std::uint16_t count) {
        Bytes stream;
        for (std::uint16_t i = 0; i < count; ++i) {
            stream = stream + modbus::encode_mbap(i, 1, read_pdu(i));
        }
        return stream;
    }
    /// The bus answers in turn, and each answer is the client's next reply.
    void expect_values(Client& client, std::uint16_t first, std::uint16_t end) {
        for (std::uint16_t i = first; i < end; ++i) {
            ASSERT_TRUE(run_until([&] { return !bus1.held.empty(); }));
            ASSERT_LE(bus1.held.size(), settings.in_flight);
            ASSERT_EQ(bus1.held[0].request.request.pdu(), read_pdu(i));
            bus1.answer(0, reply_to_read(i));
            ASSERT_EQ(client.receive(), (modbus::Adu{i, 1, reply_to_read(i)}));
        }
    }
    void expect_refusals(Client& client, std::uint16_t first, std::uint16_t end) {
        for (std::uint16_t i = first; i < end; ++i) {
            ASSERT_EQ(client.receive(), (modbus::Adu{i, 1, "83 0a"_hex}));
        }
    }
    void do_all_that_is_due() {
        context.restart();
        while (context.poll() != 0) {
        }
    }
};

TEST_F(SessionPipeline, P3P9AnswersThirtyPipelinedReadsWithSixteenOfThemOnTheBus) {
    start();
    Client client = connect();
    client.send(reads(30));
    ASSERT_TRUE(run_until_pending(16));
    expect_values(client, 0, 30);
    EXPECT_EQ(bus1.seen.size(), 30U);
}

TEST_F(SessionPipeline, P9TakesEightyRequestsAndThenNoMore) {
    start();
    Client client = connect();
    client.send(reads(100));
    ASSERT_TRUE(run_until_pending(16));
    bool stopped = false;
    listener->stop([&] { stopped = true; });
    expect_values(client, 0, 16);
    expect_refusals(client, 16, 80);
    EXPECT_TRUE(client.sees_close()) << "nobody has taken the others, nobody answers them";
    EXPECT_TRUE(run_until([&] { return stopped; }));
    EXPECT_EQ(bus1.seen.size(), 16U);
}

TEST_F(SessionPipeline, ReadsUnansweredInputSoThatTheLastRepliesArrive) {
    settings.in_flight = 1;
    settings.waiting = 1;
    start();
    Client client = connect();
    client.send(reads(1000));  // more than one read(), so some of it stays in the kernel
    ASSERT_TRUE(run_until_pending(1));
    listener->stop([] {});
    do_all_that_is_due();
    expect_values(client, 0, 1);
    expect_refusals(client, 1, 2);
    EXPECT_TRUE(client.sees_close());
    EXPECT_FALSE(client.was_reset());
}

TEST_F(SessionPipeline, P9LetsTcpThrottleAClientThatAsksTooMuch) {
    settings.retransmissions = Retransmissions::pass;  // all of them are the same
    start();
    Client client = connect();
    client.socket().set_option(asio::socket_base::send_buffer_size(4096));
    const Bytes write = modbus::encode_mbap(1, 1, "10 0000 007b f6"_hex + Bytes(246, 0));
    std::size_t sent = 0;
    const auto send_some = [&] {
        const auto n = client.try_send(ByteView(write).subspan(sent % write.size()));
        sent += n.value_or(0);
        return n.value_or(0) != 0;
    };
    int held_up = 0;
    while (held_up < 20 && sent < 64U * 1024 * 1024) {
        held_up = send_some() ? 0 : held_up + 1;
        do_all_that_is_due();
    }
    ASSERT_EQ(held_up, 20) << "somebody takes everything";
    EXPECT_EQ(bus1.seen.size(), 16U);
    ASSERT_GT(sent / write.size(), 80U);

    const std::size_t asked = (sent + write.size() - 1) / write.size();
    for (std::size_t i = 0; i < asked; ++i) {
        while (sent < asked * write.size() && send_some()) {
        }
        ASSERT_TRUE(run_until([&] { return !bus1.held.empty(); }));
        ASSERT_LE(bus1.held.size(), 16U);
        bus1.answer(0, "10 0000 007b"_hex);
        ASSERT_EQ(client.receive()->pdu, "10 0000 007b"_hex);
    }
    EXPECT_EQ(bus1.seen.size(), asked);
    EXPECT_EQ(listener->counters().protocol_errors, 0U);
}

TEST_F(SessionPipeline, ASlowPanelDelaysNoOtherUntilEightyAnswersAreOutstanding) {
    settings.in_flight = 2;
    settings.waiting = 3;
    start();
    Client client = connect();
    client.send(reads(8));
    for (std::uint16_t i = 1; i < 5; ++i) {
        ASSERT_TRUE(run_until_pending(2));
        ASSERT_EQ(bus1.held[1].request.request.pdu(), read_pdu(i));
        bus1.answer(1, reply_to_read(i));
    }
    do_all_that_is_due();
    EXPECT_EQ(bus1.held.size(), 1U) << "what waits for the first reply is bounded too";
    bus1.answer(0, reply_to_read(0));
    for (std::uint16_t i = 0; i < 5; ++i) EXPECT_EQ(client.receive()->pdu, reply_to_read(i));
    expect_values(client, 5, 8);
}

TEST_F(SessionPipeline, RefusalsAndItsOwnRegistersKeepTheirPlaces) {
    settings.in_flight = 2;
    start();
    Client client = connect();
    client.send(reads(2) + modbus::encode_mbap(2, 248, read_pdu(2)) +
                modbus::encode_mbap(3, 255, "03 0005 0001"_hex) +
                modbus::encode_mbap(4, 1, "03 00"_hex) + modbus::encode_mbap(5, 1, read_pdu(5)));
    ASSERT_TRUE(run_until_pending(2));
    bus1.line.queue_depth = 7;
    bus1.answer(1, reply_to_read(1));
    ASSERT_TRUE(run_until_pending(2));
    bus1.line.queue_depth = 9;
    bus1.answer(1, reply_to_read(5));
    do_all_that_is_due();
    EXPECT_FALSE(client.has_input());
    bus1.answer(0, reply_to_read(0));
    EXPECT_EQ(client.receive(), (modbus::Adu{0, 1, reply_to_read(0)}));
    EXPECT_EQ(client.receive(), (modbus::Adu{1, 1, reply_to_read(1)}));
    EXPECT_EQ(client.receive(), (modbus::Adu{2, 248, "83 0a"_hex}));
    EXPECT_EQ(client.receive(), (modbus::Adu{3, 255, "03 02 0007"_hex})) << "as it was at its turn";
    EXPECT_EQ(client.receive(), (modbus::Adu{4, 1, "83 03"_hex}));
    EXPECT_EQ(client.receive(), (modbus::Adu{5, 1, reply_to_read(5)}));
}

TEST_F(SessionPipeline, ABroadcastWaitsForItsTurnAndKeepsItsPlace) {
    settings.lines = {"floor1", "floor2"};
    settings.in_flight = 2;
    bus1.rights = {};
    start();
    Client client = connect();
    client.send(reads(2) + modbus::encode_mbap(2, 0, "06 0000 0001"_hex) +
                modbus::encode_mbap(3, 1, read_pdu(3)));
    ASSERT_TRUE(run_until_pending(2));
    EXPECT_TRUE(bus2.seen.empty());
    bus1.answer(0, reply_to_read(0));
    ASSERT_TRUE(run_until([&] { return bus2.held.size() == 1; }));
    bus1.answer(0, reply_to_read(1));
    ASSERT_TRUE(run_until([&] { return bus1.held.size() == 2; }));
    EXPECT_EQ(bus1.held[0].request.station, 0) << "one of the two places";
    bus1.answer(1, reply_to_read(3));
    bus1.answer(0, "06 0000 0001"_hex);
    bus2.answer(0, "06 0000 0001"_hex);
    EXPECT_EQ(client.receive()->pdu, reply_to_read(0));
    EXPECT_EQ(client.receive()->pdu, reply_to_read(1));
    EXPECT_EQ(client.receive(), (modbus::Adu{2, 0, "06 0000 0001"_hex}));
    EXPECT_EQ(client.receive(), (modbus::Adu{3, 1, reply_to_read(3)}));
}

TEST_F(SessionPipeline, DoesNotBlameAClientForAnAduThatIsNotRead) {
    settings.in_flight = 2;
    settings.waiting = 3;
    start();
    Client client = connect();
    const Bytes half = "0005 0000 0006 01"_hex;
    client.send(reads(5) + half);
    ASSERT_TRUE(run_until_pending(2));
    Client bystander = connect();
    bystander.send(half);
    ASSERT_TRUE(run_until_armed());
    clock.advance(settings.partial_adu_timeout);
    EXPECT_TRUE(bystander.sees_close()) << "it has begun later, and its time is over";
    client.send(read_pdu(5));
    expect_values(client, 0, 6);
    EXPECT_EQ(listener->counters().protocol_errors, 1U);
}

TEST_F(SessionPipeline, LimitsTheTimeOfAHalfSentAduOnceItReadsAgain) {
    settings.in_flight = 2;
    settings.waiting = 3;
    start();
    Client client = connect();
    client.send(reads(5) + "0005 0000 0006 01"_hex);
    ASSERT_TRUE(run_until_pending(2));
    EXPECT_EQ(clock.next(), std::nullopt) << "nobody reads it";
    expect_values(client, 0, 5);
    ASSERT_TRUE(run_until_armed()) << "the half-sent ADU";
    clock.advance(settings.partial_adu_timeout);
    EXPECT_TRUE(client.sees_close());
    EXPECT_EQ(listener->counters().protocol_errors, 1U);
}

TEST_F(SessionPipeline, ClosesForABrokenLengthOnlyWhenItsTurnHasCome) {
    settings.in_flight = 2;
    settings.waiting = 3;
    start();
    Client client = connect();
    client.send(reads(6) + "0006 0000 0000 01"_hex);
    expect_values(client, 0, 1);
    EXPECT_EQ(listener->counters().protocol_errors, 0U) << "it is not looked at yet";
    bus1.answer(0, reply_to_read(1));
    EXPECT_TRUE(client.sees_close());
    EXPECT_EQ(listener->counters().protocol_errors, 1U);
    EXPECT_TRUE(bus1.held.empty());
}

TEST_F(SessionPipeline, P3P9AClientThatDoesNotReadIsNotAskedForAndGetsEverythingInTheEnd) {
    bus1.instant = "41"_hex + Bytes(252, 7);
    start();
    Client slow(context, listener->port(), 4096);
    Client bystander = connect();
    constexpr std::uint16_t kRequests = 2000;
    Bytes stream;
    for (std::uint16_t i = 0; i < kRequests; ++i) {
        stream = stream + modbus::encode_mbap(i, 1, "41"_hex);
    }
    slow.send(stream);
    do_all_that_is_due();
    EXPECT_EQ(bystander.ask(1, "41"_hex), *bus1.instant);
    EXPECT_GE(bus1.seen.size(), settings.in_flight);
    EXPECT_LT(bus1.seen.size(), kRequests / 4U) << "the others would only wait to be read";
    for (std::uint16_t i = 0; i < kRequests; ++i) {
        ASSERT_EQ(slow.receive(), (modbus::Adu{i, 1, *bus1.instant}));
    }
    EXPECT_EQ(bus1.seen.size(), kRequests + 1U);
}

}  // namespace
}  // namespace panelgate::tcp_server::session_pipeline_test
