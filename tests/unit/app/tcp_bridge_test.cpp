#include "simulated_panels.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/system/error_code.hpp>
#include <cstddef>
#include <cstdint>

#include "panelgate/line/pty.hpp"

namespace panelgate::app::tcp_bridge_test {
namespace {

namespace asio = boost::asio;

class TcpBridgeTest : public testing::Test {
  protected:
    void connect() {
        client.connect({asio::ip::make_address("127.0.0.1"), bridge.port()});
        io.poll();
    }

    asio::io_context io{1};
    line::Pty pty;
    TcpBridge bridge{io.get_executor(), {"127.0.0.1", 0}, pty.path()};
    asio::ip::tcp::socket client{io};
};

TEST_F(TcpBridgeTest, AClientThatDoesNotReadLosesBytesInsteadOfHoldingTheLoop) {
    connect();
    constexpr std::size_t kMoreThanSocketsHold = 32 * 1024 * 1024;
    const std::array<std::uint8_t, 1024> bytes{};
    std::size_t taken = 0;
    while (taken < kMoreThanSocketsHold) {
        const ssize_t n = ::write(pty.master(), bytes.data(), bytes.size());
        if (n > 0) taken += static_cast<std::size_t>(n);
        io.poll();
    }
    EXPECT_GE(taken, kMoreThanSocketsHold);
}

TEST_F(TcpBridgeTest, WhatNobodyTakesFromTheLineIsLost) {
    connect();
    client.non_blocking(true);
    constexpr std::size_t kMoreThanAPtyHolds = 1024 * 1024;
    const std::array<std::uint8_t, 1024> bytes{};
    std::size_t sent = 0;
    while (sent < kMoreThanAPtyHolds) {
        boost::system::error_code full;
        sent += client.send(asio::buffer(bytes), 0, full);
        io.poll();
    }
    EXPECT_GE(sent, kMoreThanAPtyHolds);
}

}  // namespace
}  // namespace panelgate::app::tcp_bridge_test
