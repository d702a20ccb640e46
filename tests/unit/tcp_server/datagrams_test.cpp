#include <gtest/gtest.h>

#include <boost/asio/ip/udp.hpp>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <system_error>
#include <vector>

#include "loopback.hpp"

namespace panelgate::tcp_server::datagrams_test {
namespace {

using asio::ip::udp;

/// A UDP client.
class Sender {
  public:
    Sender(asio::io_context& context, std::uint16_t port, const char* own_address = "127.0.0.1")
        : context_(context),
          socket_(context, udp::endpoint(asio::ip::make_address(own_address), 0)) {
        socket_.connect(udp::endpoint(asio::ip::address_v4::loopback(), port));
        socket_.non_blocking(true);
    }
    void send(const Bytes& datagram) { socket_.send(asio::buffer(datagram)); }
    void request(std::uint16_t transaction, std::uint8_t unit, const Bytes& pdu) {
        send(modbus::encode_mbap(transaction, unit, pdu));
    }
    void read(std::uint16_t number) { request(number, 1, read_pdu(number)); }
    /// Returns the next datagram; nullopt after a generous timeout.
    std::optional<Bytes> receive() {
        Bytes datagram(1024, 0);
        error_code error = asio::error::would_block;
        run_until(context_, [&] {
            datagram.resize(1024);
            datagram.resize(socket_.receive(asio::buffer(datagram), 0, error));
            return !error;
        });
        return error ? std::nullopt : std::optional(datagram);
    }
    bool has_input() const { return socket_.available() != 0; }

  private:
    asio::io_context& context_;
    udp::socket socket_;
};

class DatagramsTest : public Loopback {
  protected:
    DatagramsTest() { settings.udp = true; }
    /// Starts the listener if there is none.
    Sender sender(const char* own_address = "127.0.0.1") {
        if (!listener) start();
        return Sender(context, listener->port(), own_address);
    }
    static Bytes adu(std::uint16_t transaction, std::uint8_t unit, const Bytes& pdu) {
        return modbus::encode_mbap(transaction, unit, pdu);
    }
    static Bytes read_adu(std::uint16_t number) { return adu(number, 1, reply_to_read(number)); }
    bool run_until_refused(std::uint64_t count) {
        return run_until([this, count] { return counters().refused == count; });
    }
    void read(Sender& client, std::uint16_t number, std::size_t pending) {
        client.read(number);
        ASSERT_TRUE(run_until_pending(pending));
    }
    bool is_served(Sender& client) {
        client.read(1);
        return client.receive() == adu(1, 1, bus1.instant.value());
    }
};

TEST_F(DatagramsTest, OneDatagramIsOneAduAndItsSenderIsAnswered) {
    Sender first = sender();
    Sender second = sender();
    first.request(1, 1, read_pdu(10));
    ASSERT_TRUE(run_until_pending(1));
    second.request(1, 1, read_pdu(20));
    ASSERT_TRUE(run_until_pending(2));
    bus1.answer(1, reply_to_read(20));
    bus1.answer(0, reply_to_read(10));
    EXPECT_EQ(first.receive(), adu(1, 1, reply_to_read(10)));
    EXPECT_EQ(second.receive(), adu(1, 1, reply_to_read(20)));
    first.request(2, 248, read_pdu(1));
    EXPECT_EQ(first.receive(), adu(2, 248, "83 0a"_hex));
}

TEST_F(DatagramsTest, ConnectionsAreServedOnTheSamePort) {
    bus1.instant = reply_to_read(7);
    Client client = connect();
    EXPECT_TRUE(Loopback::is_served(client));
    Sender other = sender();
    EXPECT_TRUE(is_served(other));
}

TEST_F(DatagramsTest, WithoutTheKeyThereIsNoUdpSocket) {
    settings.udp = false;
    start();
    udp::socket probe(context, udp::endpoint(asio::ip::address_v4::loopback(), listener->port()));
    EXPECT_TRUE(probe.is_open()) << "the port is free";
}

TEST_F(DatagramsTest, WhatIsNoAduIsDroppedAndCounted) {
    bus1.instant = reply_to_read(7);
    Sender client = sender();
    const Bytes good = adu(1, 1, read_pdu(7));
    const std::vector<Bytes> bad = {{},                                    // nothing in it
                                    Bytes(good.begin(), good.end() - 1),   // short
                                    good + "00"_hex,                       // long
                                    good + good,                           // two
                                    "0001 0001 0006 01 03 0007 0001"_hex,  // another protocol
                                    "0001 0000 0001 01"_hex,               // no function
                                    adu(1, 1, Bytes(254, 0x41)),           // longer than any ADU
                                    Bytes(1000, 0x41)};
    for (std::size_t i = 0; i < bad.size(); ++i) {
        client.send(bad[i]);
        ASSERT_TRUE(run_until_errors(i + 1)) << i;
    }
    EXPECT_TRUE(is_served(client));
    EXPECT_EQ(bus1.seen.size(), 1U);
}

TEST_F(DatagramsTest, P2ADatagramThatComesTwiceHasOneAnswer) {
    Sender client = sender();
    for (int i = 0; i < 3; ++i) client.read(1);
    for (int i = 0; i < 3; ++i) client.request(2, 1, "06 0001 0002"_hex);
    read(client, 3, 3);
    bus1.answer(0, reply_to_read(1));
    bus1.answer(0, "06 0001 0002"_hex);
    bus1.answer(0, reply_to_read(3));
    EXPECT_EQ(client.receive(), read_adu(1));
    EXPECT_EQ(client.receive(), adu(2, 1, "06 0001 0002"_hex));
    EXPECT_EQ(client.receive(), read_adu(3));
    EXPECT_FALSE(client.has_input());
}

TEST_F(DatagramsTest, P9WhatFindsNoRoomIsDropped) {
    settings.in_flight = 2;
    settings.waiting = 3;
    Sender client = sender();
    for (std::uint16_t i = 0; i < 8; ++i) client.read(i);
    ASSERT_TRUE(run_until_refused(3));
    for (std::uint16_t i = 0; i < 5; ++i) {
        ASSERT_TRUE(run_until([&] { return !bus1.held.empty(); }));
        ASSERT_LE(bus1.held.size(), 2U);
        bus1.answer(0, reply_to_read(i));
        EXPECT_EQ(client.receive(), read_adu(i));
    }
    EXPECT_EQ(bus1.seen.size(), 5U);
    EXPECT_FALSE(client.has_input());
    EXPECT_EQ(counters().protocol_errors, 0U);
}

TEST_F(DatagramsTest, P9AnAddressHasAFewPeersAndAnIdleOneIsEvicted) {
    settings.udp_peers_per_address = 2;
    Sender first = sender();
    Sender second = sender();
    Sender third = sender();
    Sender elsewhere = sender("127.0.0.2");
    first.read(1);
    read(second, 2, 2);
    third.read(3);
    ASSERT_TRUE(run_until_refused(1)) << "both places are taken";
    read(elsewhere, 4, 3);
    bus1.answer(0, reply_to_read(1));
    EXPECT_EQ(first.receive(), read_adu(1));
    read(third, 5, 3);
    EXPECT_EQ(bus1.cancelled.size(), 1U) << "the first has asked for nothing else";
}

TEST_F(DatagramsTest, P9AllOfThemTogetherAreBoundedToo) {
    settings.max_connections = 2;
    std::vector<Sender> senders;
    for (const char* address : {"127.0.0.2", "127.0.0.3", "127.0.0.4"})
        senders.push_back(sender(address));
    for (Sender& one : senders) one.read(1);
    ASSERT_TRUE(run_until_refused(1));
    EXPECT_EQ(bus1.seen.size(), 2U);
    EXPECT_EQ(counters().protocol_errors, 0U);
}

TEST_F(DatagramsTest, P9OneAddressNeverHasThemAll) {
    settings.max_connections = 4;
    std::vector<Sender> senders;
    for (int i = 0; i < 3; ++i) senders.push_back(sender());
    for (Sender& one : senders) one.read(1);
    ASSERT_TRUE(run_until_refused(1));
    ASSERT_EQ(bus1.held.size(), 2U);
    Sender elsewhere = sender("127.0.0.2");
    read(elsewhere, 1, 3);
    EXPECT_TRUE(bus1.cancelled.empty());
}

TEST_F(DatagramsTest, APeerThatIsNotAllowedIsNotAnswered) {
    settings.allow = {{"127.0.0.1", 32}};
    bus1.instant = reply_to_read(1);
    Sender stranger = sender("127.0.0.2");
    stranger.read(1);
    ASSERT_TRUE(run_until([&] { return log.count("datagram refused") == 1; }));
    Sender known = sender();
    EXPECT_TRUE(is_served(known));
    EXPECT_FALSE(stranger.has_input());
    EXPECT_EQ(bus1.seen.size(), 1U);
}

TEST_F(DatagramsTest, P3WhatIsOutstandingAtTheEndIsAnswered) {
    settings.in_flight = 1;
    Sender client = sender();
    client.read(1);
    read(client, 2, 1);
    stop();
    do_all_that_is_due();
    EXPECT_FALSE(stopped);
    bus1.answer(0, reply_to_read(1));
    EXPECT_EQ(client.receive(), read_adu(1));
    EXPECT_EQ(client.receive(), adu(2, 1, "83 0a"_hex)) << "it has never started";
    EXPECT_TRUE(run_until_stopped());
}

TEST_F(DatagramsTest, P2CutOffItTakesItsRequestsBack) {
    Sender client = sender();
    read(client, 1, 1);
    listener->close_now();
    EXPECT_EQ(bus1.cancelled.size(), 1U);
    EXPECT_TRUE(bus1.held.empty());
}

TEST_F(DatagramsTest, APortInUseIsReportedAndNothingIsOpen) {
    start();
    const std::uint16_t port = listener->port();
    listener.reset();
    udp::socket taken(context, udp::endpoint(asio::ip::address_v4::loopback(), port));
    settings.port = port;
    EXPECT_THROW(start(), std::system_error);
    EXPECT_EQ(listener->port(), 0);
}

}  // namespace
}  // namespace panelgate::tcp_server::datagrams_test
