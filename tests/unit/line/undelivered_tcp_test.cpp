// P1: a server that does not take written bytes, and what happens to them.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "line_events.hpp"
#include "panelgate/line/tcp_line.hpp"
#include "panelgate/rt/asio_clock.hpp"
#include "support/hex.hpp"

namespace panelgate::line::undelivered_tcp_test {
namespace {

using boost::asio::ip::tcp;
using boost::system::error_code;

constexpr Duration kDelayedAck = 200ms;

class UndeliveredTcp : public testing::Test {
  protected:
    UndeliveredTcp() {
        // Before it listens: the window is agreed when a connection begins.
        acceptor.open(tcp::v4());
        acceptor.set_option(boost::asio::socket_base::receive_buffer_size(1));
        acceptor.bind({boost::asio::ip::address_v4::loopback(), 0});
        acceptor.listen();
        Settings settings;
        settings.device = "tcp://127.0.0.1:" + std::to_string(acceptor.local_endpoint().port());
        settings.reopen_min = 1ms;
        line = make_tcp_line(io.get_executor(), clock, settings);
        connect([this] { line->start(heard); });
    }
    void run_until(const std::function<bool()>& so) {
        while (!so()) io.run_one_for(1ms);  // some of it changes in the kernel, without an event
    }
    /// `begin` makes the line connect.
    void connect(const std::function<void()>& begin) {
        bool accepted = false;
        const int ups = heard.ups;
        peer.emplace(io);
        acceptor.async_accept(*peer, [&](error_code error) { accepted = !error; });
        begin();
        run_until([&] { return accepted && heard.ups == ups + 1; });
    }
    /// More than the server's window takes, and less than this end's socket buffer.
    void write_into_the_window() { line->write(Bytes(kManyBytes, 0x55)); }
    /// Reads at the server to the end of the connection; returns how it ended.
    error_code read_all() {
        std::optional<error_code> end;
        got.assign(2 * kManyBytes, 0);
        boost::asio::async_read(*peer, boost::asio::buffer(got), [&](error_code error, auto count) {
            got.resize(count);
            end = error;
        });
        run_until([&] { return end.has_value(); });
        return *end;
    }

    static constexpr std::size_t kManyBytes = 20'000;
    boost::asio::io_context io{1};
    rt::AsioClock clock{io.get_executor()};
    tcp::acceptor acceptor{io};
    std::optional<tcp::socket> peer;
    std::unique_ptr<Line> line;
    Heard heard;
    Bytes got;
};

TEST_F(UndeliveredTcp, WhatTheServersSystemHasTakenIsDelivered) {
    line->write("01 03 00 00 00 01 84 0A"_hex);
    run_until([&] { return peer->available() == 8; });
    EXPECT_FALSE(line->undelivered());
    // Also after the time of a delayed acknowledgement, with nothing read.
    const TimePoint over = clock.now() + kDelayedAck + line->latency();
    run_until([&] { return clock.now() > over; });
    EXPECT_FALSE(line->undelivered());
    EXPECT_TRUE(heard.downs.empty());
}

TEST_F(UndeliveredTcp, FramesThatAreEachAcknowledgedInTimeAreDelivered) {
    got.assign(kManyBytes, 0);
    boost::asio::async_read(*peer, boost::asio::buffer(got), [](error_code, std::size_t) {});
    const TimePoint end = clock.now() + 2 * kDelayedAck;
    TimePoint next{};
    run_until([&] {
        EXPECT_FALSE(line->undelivered());
        if (clock.now() < next) return false;
        line->write("01 03 00 00 00 01 84 0A"_hex);
        next = clock.now() + 15ms;  // more often than Linux acknowledges
        return next > end;
    });
    EXPECT_TRUE(heard.downs.empty());
}

TEST_F(UndeliveredTcp, AServerThatReadsNothingDoesNotDeliverAndSeesTheReset) {
    EXPECT_FALSE(line->undelivered());
    const TimePoint begin = clock.now();
    write_into_the_window();
    run_until([&] { return line->undelivered(); });
    EXPECT_GE(clock.now() - begin, kDelayedAck);  // until then it may be on its way
    EXPECT_TRUE(heard.downs.empty());
    line->reset("the request was not taken");
    ASSERT_EQ(heard.downs.size(), 1u);
    EXPECT_NE(heard.downs[0].find(" is opened anew: the request was not taken"), std::string::npos);
    EXPECT_FALSE(line->undelivered());
    EXPECT_EQ(read_all(), boost::asio::error::connection_reset);
    EXPECT_LT(got.size(), kManyBytes);
}

TEST_F(UndeliveredTcp, TheNextConnectionCarriesNothingOfTheOneBefore) {
    write_into_the_window();
    run_until([&] { return line->undelivered(); });
    std::optional<tcp::socket> first = std::move(peer);
    connect([this] { line->reset("the request was not taken"); });
    EXPECT_EQ(line->counters().reopens, 1u);
    EXPECT_FALSE(line->undelivered());
    line->write("01 02 03"_hex);
    run_until([&] { return peer->available() == 3; });
    line->stop();
    EXPECT_EQ(read_all(), boost::asio::error::eof);  // a normal close: nothing was left to drop
    EXPECT_EQ(got, "01 02 03"_hex);
}

TEST_F(UndeliveredTcp, TheNextFrameIsNotPutBehindOneThatWasNotTaken) {
    write_into_the_window();
    run_until([&] { return line->undelivered(); });
    line->write("01 02 03"_hex);
    ASSERT_EQ(heard.downs.size(), 1u);
    EXPECT_NE(heard.downs[0].find(" is opened anew: the connection takes nothing"),
              std::string::npos);
    EXPECT_EQ(read_all(), boost::asio::error::connection_reset);
}

TEST_F(UndeliveredTcp, WhatHasNotArrivedIsDroppedWhenTheLineIsStopped) {
    write_into_the_window();
    run_until([&] { return line->undelivered(); });
    line->stop();
    EXPECT_TRUE(heard.downs.empty());
    EXPECT_EQ(read_all(), boost::asio::error::connection_reset);
}

/// Both ends of the connection are in this program: the line's is connected to the server.
int descriptor_of(const tcp::endpoint& server) {
    for (int fd = 0; fd < 1024; ++fd) {
        sockaddr_in to{};
        socklen_t size = sizeof to;
        if (::getpeername(fd, reinterpret_cast<sockaddr*>(&to), &size) != 0) continue;
        if (to.sin_family == AF_INET && ntohs(to.sin_port) == server.port()) return fd;
    }
    return -1;
}

TEST_F(UndeliveredTcp, P7TheKernelGivesUpInSecondsAndNotForOneLostProbe) {
    const int fd = descriptor_of(acceptor.local_endpoint());
    ASSERT_GE(fd, 0);
    const auto option = [fd](int name) {
        int value = 0;
        socklen_t size = sizeof value;
        EXPECT_EQ(::getsockopt(fd, IPPROTO_TCP, name, &value, &size), 0);
        return value;
    };
    const auto patience = std::chrono::milliseconds(option(TCP_USER_TIMEOUT));
    EXPECT_GE(patience, 2s);
    EXPECT_LE(patience, 10s);
    // TCP_USER_TIMEOUT ends keep-alive too, whatever the number of probes.
    const int probes = 3;
    EXPECT_LE(std::chrono::seconds(option(TCP_KEEPIDLE) + probes * option(TCP_KEEPINTVL)),
              patience);
}

}  // namespace
}  // namespace panelgate::line::undelivered_tcp_test
