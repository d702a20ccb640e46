#include <gmock/gmock.h>

#include "loopback.hpp"

namespace panelgate::tcp_server::session_end_test {
namespace {

using ::testing::ElementsAre;

// Clients that disconnect, and clients that do not read.
class SessionEnd : public Loopback {
  protected:
    /// More than the session takes before it stops reading; identified by their addresses.
    void send_hundred_reads(Client& client) {
        Bytes stream;
        for (std::uint16_t i = 0; i < 100; ++i) {
            stream = stream + modbus::encode_mbap(i, 1, read_pdu(i));
        }
        client.send(stream);
    }
    void answer_and_receive(Client& client, std::uint16_t first, std::uint16_t end) {
        for (std::uint16_t i = first; i < end; ++i) {
            ASSERT_TRUE(run_until([&] { return !bus1.held.empty(); }));
            bus1.answer(0, reply_to_read(i));
            ASSERT_EQ(client.receive(), (modbus::Adu{i, 1, reply_to_read(i)}));
        }
    }
};

TEST_F(SessionEnd, TakesItsRequestsBackWhenTheClientIsReset) {
    start();
    Client client = connect();
    client.request(1, 1, read_pdu(1));
    ASSERT_TRUE(run_until_pending(1));
    const bus::ClientId id = bus1.held[0].request.client;
    client.socket().set_option(asio::socket_base::linger(true, 0));
    client.socket().close();
    ASSERT_TRUE(run_until([&] { return !bus1.cancelled.empty(); }));
    EXPECT_THAT(bus1.cancelled, ElementsAre(id));
    EXPECT_THAT(bus2.cancelled, ElementsAre()) << "it never used that one";
    EXPECT_EQ(listener->counters().connections, 0U);
}

TEST_F(SessionEnd, P2NoticesAfterTheFirstReplyThatTheClientHasClosed) {
    start();
    Client client = connect();
    for (std::uint16_t i = 0; i < 3; ++i) client.request(i, 1, read_pdu(i));
    ASSERT_TRUE(run_until_pending(3));
    client.socket().close();
    bus1.answer(0, reply_to_read(0));
    ASSERT_TRUE(run_until([&] { return listener->counters().connections == 0; }));
    EXPECT_TRUE(bus1.held.empty());
}

TEST_F(SessionEnd, P2NoticesAResetAlsoWhileItDoesNotRead) {
    start();
    Client client = connect();
    send_hundred_reads(client);
    ASSERT_TRUE(run_until_pending(16));
    client.socket().set_option(asio::socket_base::linger(true, 0));
    client.socket().close();
    ASSERT_TRUE(run_until([&] { return listener->counters().connections == 0; }));
    EXPECT_TRUE(bus1.held.empty());
    EXPECT_EQ(bus1.seen.size(), 16U) << "what waited in the session never starts";
}

TEST_F(SessionEnd, P2NoticesAfterTheFirstReplyThatAClientHasClosedWhileItDidNotRead) {
    start();
    Client client = connect();
    send_hundred_reads(client);
    ASSERT_TRUE(run_until_pending(16));
    client.socket().close();
    bus1.answer(0, reply_to_read(0));
    ASSERT_TRUE(run_until([&] { return listener->counters().connections == 0; }));
    EXPECT_TRUE(bus1.held.empty());
    EXPECT_EQ(bus1.seen.size(), 17U) << "one took the place of the one that was answered";
}

TEST_F(SessionEnd, AnswersEverythingAlsoWhenTheSendingSideWasClosedWhileItDidNotRead) {
    start();
    Client client = connect();
    send_hundred_reads(client);
    client.socket().shutdown(tcp::socket::shutdown_send);
    answer_and_receive(client, 0, 100);
    EXPECT_TRUE(client.sees_close());
    EXPECT_EQ(listener->counters().protocol_errors, 0U);
}

TEST_F(SessionEnd, P3WhatWaitsIsAskedAlsoLongAfterTheSendingSideWasClosed) {
    start();
    Client client = connect();
    send_hundred_reads(client);
    answer_and_receive(client, 0, 60);  // forty are left
    client.socket().shutdown(tcp::socket::shutdown_send);
    context.restart();
    context.poll();
    clock.advance(2 * settings.output_timeout + settings.partial_adu_timeout);
    EXPECT_EQ(bus1.held.size(), 16U);
    answer_and_receive(client, 60, 100);
    EXPECT_TRUE(client.sees_close());
    EXPECT_FALSE(client.was_reset());
}

TEST_F(SessionEnd, P2AResetAfterTheFinTakesWhatWaitsAway) {
    start();
    Client client = connect();
    send_hundred_reads(client);
    answer_and_receive(client, 0, 60);
    client.socket().shutdown(tcp::socket::shutdown_send);
    ASSERT_TRUE(run_until_pending(16));
    client.socket().set_option(asio::socket_base::linger(true, 0));
    client.socket().close();
    ASSERT_TRUE(run_until([&] { return listener->counters().connections == 0; }));
    EXPECT_TRUE(bus1.held.empty());
    EXPECT_EQ(bus1.seen.size(), 76U);
}

TEST_F(SessionEnd, AnswersAClientThatHasOnlyClosedItsSendingSide) {
    start();
    Client client = connect();
    client.request(1, 1, read_pdu(1));
    client.request(2, 1, read_pdu(2));
    client.socket().shutdown(tcp::socket::shutdown_send);
    ASSERT_TRUE(run_until_pending(2));
    bus1.answer(1, reply_to_read(2));
    bus1.answer(0, reply_to_read(1));
    EXPECT_EQ(client.receive(), (modbus::Adu{1, 1, reply_to_read(1)}));
    EXPECT_EQ(client.receive(), (modbus::Adu{2, 1, reply_to_read(2)}));
    EXPECT_TRUE(client.sees_close());
    EXPECT_EQ(listener->counters().protocol_errors, 0U);
}

TEST_F(SessionEnd, ClosesAClientThatReadsNothingForLongAndAffectsNoOther) {
    settings.retransmissions = Retransmissions::pass;  // all requests are the same
    bus1.instant = "41"_hex + Bytes(252, 0);
    start();
    Client bystander = connect();
    Client slow(context, listener->port(), 4096);
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
    EXPECT_EQ(listener->counters().connections, 1U);
}

TEST_F(SessionEnd, ASlowClientThatTakesSomethingInEachPeriodStays) {
    bus1.instant = reply_to_read(1);
    start();
    Client client = connect();
    for (int i = 0; i < 5; ++i) {
        EXPECT_EQ(client.ask(1, read_pdu(1)), reply_to_read(1));
        context.restart();
        context.poll();  // handle the write completion, too
        clock.advance(settings.output_timeout);
    }
    EXPECT_EQ(log.count("does not read"), 0U);
    EXPECT_EQ(listener->counters().connections, 1U);
}

}  // namespace
}  // namespace panelgate::tcp_server::session_end_test
