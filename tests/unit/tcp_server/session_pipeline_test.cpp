#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <optional>

#include "loopback.hpp"

namespace panelgate::tcp_server::session_pipeline_test {
namespace {

using ::testing::ElementsAre;

// Clients that pipeline requests: PIP-01 to PIP-07.
class SessionPipeline : public Loopback {
  protected:
    void only_five_places() {
        settings.in_flight = 2;
        settings.waiting = 3;
    }
    void expect_refusals(Client& client, std::uint16_t first, std::uint16_t end) {
        for (std::uint16_t i = first; i < end; ++i)
            ASSERT_EQ(client.receive(), (modbus::Adu{i, 1, "83 0a"_hex}));
    }
};

TEST_F(SessionPipeline, P3P9AnswersThirtyPipelinedReadsWithSixteenOfThemOnTheBus) {
    Client client = connect();
    client.send(reads(30));
    ASSERT_TRUE(run_until_pending(16));
    expect_values(client, 0, 30);
    EXPECT_EQ(bus1.seen.size(), 30U);
}

TEST_F(SessionPipeline, P9TakesEightyRequestsAndThenNoMore) {
    Client client = connect();
    client.send(reads(100));
    ASSERT_TRUE(run_until_pending(16));
    stop();
    expect_values(client, 0, 16);
    expect_refusals(client, 16, 80);
    EXPECT_TRUE(client.sees_close()) << "nobody has taken the others, nobody answers them";
    EXPECT_TRUE(run_until_stopped());
    EXPECT_EQ(bus1.seen.size(), 16U);
}

TEST_F(SessionPipeline, ReadsUnansweredInputSoThatTheLastRepliesArrive) {
    settings.in_flight = 1;
    settings.waiting = 1;
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
    EXPECT_EQ(counters().protocol_errors, 0U);
}

TEST_F(SessionPipeline, ASlowPanelDelaysNoOtherUntilEightyAnswersAreOutstanding) {
    only_five_places();
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
    for (std::uint16_t i = 0; i < 5; ++i) EXPECT_EQ(client.receive(), read_reply(i));
    expect_values(client, 5, 8);
}

TEST_F(SessionPipeline, RefusalsAndItsOwnRegistersKeepTheirPlaces) {
    settings.in_flight = 2;
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
    EXPECT_EQ(client.receive(), read_reply(0));
    EXPECT_EQ(client.receive(), read_reply(1));
    EXPECT_EQ(client.receive(), (modbus::Adu{2, 248, "83 0a"_hex}));
    EXPECT_EQ(client.receive(), (modbus::Adu{3, 255, "03 02 0007"_hex})) << "as it was at its turn";
    EXPECT_EQ(client.receive(), (modbus::Adu{4, 1, "83 03"_hex}));
    EXPECT_EQ(client.receive(), read_reply(5));
}

TEST_F(SessionPipeline, ABroadcastWaitsForItsTurnAndKeepsItsPlace) {
    settings.lines = {"floor1", "floor2"};
    settings.in_flight = 2;
    bus1.rights = {};
    const Bytes write = "06 0000 0001"_hex;
    Client client = connect();
    client.send(reads(2) + modbus::encode_mbap(2, 0, write) +
                modbus::encode_mbap(3, 1, read_pdu(3)));
    ASSERT_TRUE(run_until_pending(2));
    EXPECT_TRUE(bus2.seen.empty());
    bus1.answer(0, reply_to_read(0));
    ASSERT_TRUE(run_until([&] { return bus2.held.size() == 1; }));
    bus1.answer(0, reply_to_read(1));
    ASSERT_TRUE(run_until_pending(2));
    EXPECT_EQ(bus1.held[0].request.station, 0) << "one of the two places";
    bus1.answer(1, reply_to_read(3));
    bus1.answer(0, write);
    bus2.answer(0, write);
    EXPECT_EQ(client.receive(), read_reply(0));
    EXPECT_EQ(client.receive(), read_reply(1));
    EXPECT_EQ(client.receive(), (modbus::Adu{2, 0, write}));
    EXPECT_EQ(client.receive(), read_reply(3));
}

TEST_F(SessionPipeline, DoesNotBlameAClientForAnAduThatIsNotRead) {
    only_five_places();
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
    EXPECT_EQ(counters().protocol_errors, 1U);
}

TEST_F(SessionPipeline, LimitsTheTimeOfAHalfSentAduOnceItReadsAgain) {
    only_five_places();
    Client client = connect();
    client.send(reads(5) + "0005 0000 0006 01"_hex);
    ASSERT_TRUE(run_until_pending(2));
    EXPECT_EQ(clock.next(), std::nullopt) << "nobody reads it";
    expect_values(client, 0, 5);
    ASSERT_TRUE(run_until_armed()) << "the half-sent ADU";
    clock.advance(settings.partial_adu_timeout);
    EXPECT_TRUE(client.sees_close());
    EXPECT_EQ(counters().protocol_errors, 1U);
}

TEST_F(SessionPipeline, ClosesForABrokenLengthOnlyWhenItsTurnHasCome) {
    only_five_places();
    Client client = connect();
    client.send(reads(6) + "0006 0000 0000 01"_hex);
    expect_values(client, 0, 1);
    EXPECT_EQ(counters().protocol_errors, 0U) << "it is not looked at yet";
    bus1.answer(0, reply_to_read(1));
    EXPECT_TRUE(client.sees_close());
    EXPECT_EQ(counters().protocol_errors, 1U);
    EXPECT_TRUE(bus1.held.empty());
}

TEST_F(SessionPipeline, P3P9AClientThatDoesNotReadIsNotAskedForAndGetsEverythingInTheEnd) {
    bus1.instant = "41"_hex + Bytes(252, 7);
    Client slow = connect("127.0.0.1", 4096);
    Client bystander = connect();
    constexpr std::uint16_t kRequests = 2000;
    Bytes stream;
    for (std::uint16_t i = 0; i < kRequests; ++i)
        stream = stream + modbus::encode_mbap(i, 1, "41"_hex);
    slow.send(stream);
    do_all_that_is_due();
    EXPECT_EQ(bystander.ask(1, "41"_hex), *bus1.instant);
    EXPECT_GE(bus1.seen.size(), settings.in_flight);
    EXPECT_LT(bus1.seen.size(), kRequests / 4U) << "the others would only wait to be read";
    for (std::uint16_t i = 0; i < kRequests; ++i)
        ASSERT_EQ(slow.receive(), (modbus::Adu{i, 1, *bus1.instant}));
    EXPECT_EQ(bus1.seen.size(), kRequests + 1U);
}

// Clients that disconnect, and clients that do not read.
class SessionEnd : public Loopback {
  protected:
    /// More than the session takes before it stops reading.
    void send_hundred_reads(Client& client) {
        client.send(reads(100));
        ASSERT_TRUE(run_until_pending(16));
    }
    /// The connection is gone, and with it what was on the bus.
    void expect_gone(std::size_t seen) {
        ASSERT_TRUE(run_until_connections(0));
        EXPECT_TRUE(bus1.held.empty());
        EXPECT_EQ(bus1.seen.size(), seen);
    }
};

TEST_F(SessionEnd, P2NoticesAfterTheFirstReplyThatTheClientHasClosed) {
    Client client = connect();
    client.send(reads(3));
    ASSERT_TRUE(run_until_pending(3));
    client.close();
    bus1.answer(0, reply_to_read(0));
    expect_gone(3);
    Client another = connect();  // the same, while it is not read
    send_hundred_reads(another);
    another.close();
    bus1.answer(0, reply_to_read(0));
    expect_gone(3 + 17);  // one took the place of the one that was answered
}

TEST_F(SessionEnd, P2NoticesAResetAlsoWhileItDoesNotReadOrAfterTheFin) {
    Client client = connect();
    send_hundred_reads(client);
    const bus::ClientId id = bus1.held[0].request.client;
    client.reset();
    expect_gone(16);  // what waited in the session never starts
    EXPECT_THAT(bus1.cancelled, ElementsAre(id));
    EXPECT_TRUE(bus2.cancelled.empty()) << "it never used that one";
    Client another = connect();
    send_hundred_reads(another);
    expect_values(another, 0, 60);
    another.shutdown_send();
    ASSERT_TRUE(run_until_pending(16));
    another.reset();
    expect_gone(16 + 76);
}

TEST_F(SessionEnd, AnswersEverythingAlsoWhenTheSendingSideWasClosedWhileItDidNotRead) {
    Client client = connect();
    client.send(reads(100));
    client.shutdown_send();
    expect_values(client, 0, 100);
    EXPECT_TRUE(client.sees_close());
    EXPECT_EQ(counters().protocol_errors, 0U);
}

TEST_F(SessionEnd, P3WhatWaitsIsAskedAlsoLongAfterTheSendingSideWasClosed) {
    Client client = connect();
    send_hundred_reads(client);
    expect_values(client, 0, 60);  // forty are left
    client.shutdown_send();
    do_all_that_is_due();
    clock.advance(2 * settings.output_timeout + settings.partial_adu_timeout);
    EXPECT_EQ(bus1.held.size(), 16U);
    expect_values(client, 60, 100);
    EXPECT_TRUE(client.sees_close());
    EXPECT_FALSE(client.was_reset());
}

TEST_F(SessionEnd, ClosesAClientThatReadsNothingForLongAndAffectsNoOther) {
    settings.retransmissions = Retransmissions::pass;  // all requests are the same
    bus1.instant = "41"_hex + Bytes(252, 0);
    Client bystander = connect();
    Client slow = connect("127.0.0.1", 4096);
    const Bytes request = modbus::encode_mbap(1, 1, "41"_hex);
    std::size_t offset = 0;
    // Until neither side progresses: the session waits for the client, and so takes no more
    // requests.
    for (int idle = 0; idle < 20;) {
        const auto n = slow.try_send(ByteView(request).subspan(offset));
        offset = (offset + n.value_or(0)) % request.size();
        context.restart();
        idle = context.poll() == 0 && n == 0U ? idle + 1 : 0;
    }
    clock.advance(2 * settings.output_timeout);
    EXPECT_EQ(log.count("does not read"), 1U);
    EXPECT_EQ(bystander.ask(1, "41"_hex), *bus1.instant);
    EXPECT_EQ(counters().connections, 1U);
}

TEST_F(SessionEnd, ASlowClientThatTakesSomethingInEachPeriodStays) {
    bus1.instant = reply_to_read(1);
    Client client = connect();
    for (int i = 0; i < 5; ++i) {
        EXPECT_TRUE(is_served(client));
        do_all_that_is_due();  // handle the write completion, too
        clock.advance(settings.output_timeout);
    }
    EXPECT_EQ(log.count("does not read"), 0U);
    EXPECT_EQ(counters().connections, 1U);
}

}  // namespace
}  // namespace panelgate::tcp_server::session_pipeline_test
