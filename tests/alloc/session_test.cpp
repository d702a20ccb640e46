// Real connections to a listener on a bus: from the bytes of a request to those of its reply
// nothing is taken from the heap.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <memory>
#include <thread>
#include <vector>

#include "answering_line.hpp"
#include "counting.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/modbus/framing.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/rt/asio_clock.hpp"
#include "panelgate/tcp_server/listener.hpp"

namespace panelgate::tcp_server {
namespace {

constexpr std::uint64_t kWarmUp = 1000;  // transactions
constexpr std::uint64_t kCounted = 1000;

/// A client in a thread of its own: `depth` requests open at a time, until nobody answers.
void speak(std::uint16_t port, std::size_t depth) {
    const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ASSERT_EQ(::connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
    const Bytes pdu = modbus::encode_read(modbus::Table::holding_registers, 100, 10);
    const Bytes request = modbus::encode_mbap(1, 1, pdu);
    constexpr std::size_t kReply = 29;
    std::array<std::uint8_t, 1024> buffer{};
    for (std::size_t i = 0; i < depth; ++i)
        ::send(fd, request.data(), request.size(), MSG_NOSIGNAL);
    for (std::size_t got = 0;;) {
        const ssize_t n = ::recv(fd, buffer.data(), buffer.size(), 0);
        if (n <= 0) break;
        for (got += static_cast<std::size_t>(n); got >= kReply; got -= kReply)
            ::send(fd, request.data(), request.size(), MSG_NOSIGNAL);
    }
    ::close(fd);
}

class SessionAllocations : public testing::TestWithParam<std::size_t> {
  protected:
    std::uint64_t count(std::size_t clients) {
        bus::Settings bus_settings;
        bus_settings.arbiter.serial = {1000000, 8, Parity::none, 1};
        bus_settings.arbiter.stations.resize(1);
        bus_settings.arbiter.stations[0].frame_gap = 0us;
        bus_settings.arbiter.share_reads = false;
        bus_settings.trace.frames = 200;
        bus_settings.stations[1].name = "panel";
        auto line = std::make_unique<test::AnsweringLine>(clock, 0ms);
        const test::AnsweringLine& seen = *line;
        bus::Bus bus(io.get_executor(), clock, bus_settings, std::move(line));
        bus.start();
        Settings settings;
        settings.port = 0;
        Listener listener(io.get_executor(), clock, settings,
                          UnitMap(settings, {{"floor1", &bus, {1}, true}}), "1");
        listener.start();
        std::vector<std::jthread> threads;
        for (std::size_t i = 0; i < clients; ++i)
            threads.emplace_back(speak, listener.port(), GetParam());
        while (seen.sent < kWarmUp) io.run_one();
        auto counted = taken_while(seen);
        // Threads meet as they like: more requests at once than ever before need room once.
        for (int i = 0; i < 3 && counted != 0; ++i) counted = taken_while(seen);
        listener.close_now();
        io.restart();
        io.poll();
        return counted;
    }

    /// ... kCounted transactions.
    std::uint64_t taken_while(const test::AnsweringLine& seen) {
        const auto end = seen.sent + kCounted;
        const auto before = test::allocations();
        test::watch_allocations(true);
        while (seen.sent < end) io.run_one();
        test::watch_allocations(false);
        return test::allocations() - before;
    }

    boost::asio::io_context io{1};
    rt::AsioClock clock{io.get_executor()};
};

TEST_P(SessionAllocations, OneConnection) {
    if (!test::counts_allocations()) GTEST_SKIP() << "the heap is not ours";
    EXPECT_EQ(count(1), 0u);
}

TEST_P(SessionAllocations, EightConnections) {
    if (!test::counts_allocations()) GTEST_SKIP() << "the heap is not ours";
    EXPECT_EQ(count(8), 0u);
}

INSTANTIATE_TEST_SUITE_P(Depth, SessionAllocations, testing::Values(1, 4));

}  // namespace
}  // namespace panelgate::tcp_server
