#include "panelgate/line/tcp_line.hpp"

#include <arpa/inet.h>
#include <dlfcn.h>
#include <gmock/gmock.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <atomic>
#include <boost/asio/error.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "line_events.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/rt/asio_clock.hpp"
#include "panelgate/rt/log.hpp"
#include "support/hex.hpp"
#include "support/manual_clock.hpp"

namespace {

std::atomic<int> asked;
std::atomic<bool> silent;

using GetAddrInfo = int (*)(const char*, const char*, const addrinfo*, addrinfo**);

}  // namespace

/// Replaces the system's, for this whole program. The server of names that end in ".invalid" is
/// silent until a test ends; other names resolve to the loopback.
int getaddrinfo(const char* host, const char* port, const addrinfo* hints, addrinfo** found) {
    static const auto real = reinterpret_cast<GetAddrInfo>(::dlsym(RTLD_NEXT, "getaddrinfo"));
    ++asked;
    asked.notify_all();
    if (!std::string_view(host).ends_with(".invalid")) return real("127.0.0.1", port, hints, found);
    silent.wait(true);
    return EAI_AGAIN;
}

namespace panelgate::line::tcp_line_test {
namespace {

using boost::asio::ip::tcp;
using boost::system::error_code;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr Duration kDelayedAck = 200ms;

TEST(TcpDevice, IsAHostAndAPort) {
    const std::pair<const char*, const char*> hosts[] = {
        {"moxa.local", "moxa.local"},           {"[::1]", "::1"},
        {"[fe80::1%eth0]", "fe80::1%eth0"},     {"10.0.0.30", "10.0.0.30"},
        {"1.plant.example", "1.plant.example"}, {"moxa-rack_2", "moxa-rack_2"},
    };
    for (const auto& [typed, host] : hosts) {
        const auto device = parse_tcp_device("tcp://" + std::string(typed) + ":4001");
        ASSERT_TRUE(device) << typed;
        EXPECT_EQ(device->host, host);
        EXPECT_EQ(device->port, "4001");
    }
    for (const char* text : {"tcp://", "tcp://host", "tcp://host:", "tcp://:4001", "tcp://host:0",
                             "tcp://host:65536", "tcp://host:40x", "tcp://::1:4001", "/dev/tty"})
        EXPECT_FALSE(parse_tcp_device(text)) << text;
    // A numeric address that is none is no name.
    for (const char* host : {"10.0.0.300", "10.0.0", "10", "1.2.3.4.5", "[10.0.0.1]", "[fe80::g]",
                             "my host", "admin@moxa", "m\u00F6xa"})
        EXPECT_FALSE(parse_tcp_device("tcp://" + std::string(host) + ":4001")) << host;
}

class TcpLineTest : public testing::Test {
  protected:
    TcpLineTest() {
        // Before it listens: the window is agreed when a connection begins.
        acceptor.open(tcp::v4());
        acceptor.set_option(boost::asio::socket_base::receive_buffer_size(1));
        acceptor.bind({boost::asio::ip::address_v4::loopback(), 0});
        acceptor.listen();
        settings.reopen_min = 1ms;
        point_at("127.0.0.1");
    }
    /// Lines made from now on call the server by this name.
    void point_at(const std::string& host) {
        settings.device = "tcp://" + host + ":" + std::to_string(acceptor.local_endpoint().port());
    }
    std::unique_ptr<Line> make(const std::string& host) {
        point_at(host);
        return make_tcp_line(io.get_executor(), clock, settings);
    }
    void run_until(const std::function<bool()>& so) {
        while (!so()) {
            io.restart();
            io.run_one_for(1ms);  // some of it changes in the kernel, without an event
        }
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
    void start() {
        line = make_tcp_line(io.get_executor(), clock, settings);
        connect([this] { line->start(heard); });
    }
    /// The server writes; the line hears it.
    void expect_heard(const Bytes& bytes) {
        boost::asio::write(*peer, boost::asio::buffer(bytes));
        run_until([&] { return heard.bytes.size() >= bytes.size(); });
        EXPECT_EQ(heard.bytes, bytes);
    }

    boost::asio::io_context io{1};
    rt::AsioClock clock{io.get_executor()};
    tcp::acceptor acceptor{io};
    std::optional<tcp::socket> peer;
    Settings settings;
    Heard heard;
    std::unique_ptr<Line> line;
};

TEST_F(TcpLineTest, CarriesBytesBothWaysAndConnectsAgain) {
    start();
    line->write("01 03 00 00"_hex);
    Bytes got(4);
    bool read = false;
    boost::asio::async_read(*peer, boost::asio::buffer(got),
                            [&](error_code error, std::size_t) { read = !error; });
    run_until([&] { return read; });
    EXPECT_EQ(got, "01 03 00 00"_hex);
    expect_heard("01 03 02"_hex);
    EXPECT_GE(line->latency(), Duration::zero());
    EXPECT_LT(line->latency(), Duration(1s));
    connect([] {});  // closes the socket of before
    EXPECT_THAT(heard.downs, ElementsAre(HasSubstr("is gone: hang-up")));
    EXPECT_EQ(line->counters().reopens, 1u);
    line->stop();
    EXPECT_EQ(heard.ups, 2);
    EXPECT_EQ(heard.downs.size(), 1u);
}

TEST_F(TcpLineTest, P7ReportsAClosedPortOnceAndRetries) {
    const tcp::endpoint server = acceptor.local_endpoint();
    acceptor.close();
    line = make_tcp_line(io.get_executor(), clock, settings);
    line->start(heard);
    run_until([&] { return heard.downs.size() == 1; });
    line->write("01"_hex);
    for (int i = 0; i < 20; ++i) io.run_one();
    EXPECT_THAT(heard.downs, ElementsAre(HasSubstr("cannot reach " + settings.device)));
    acceptor = tcp::acceptor(io, server);
    connect([] {});
}

TEST_F(TcpLineTest, CanBeStoppedWhileItConnects) {
    line = make_tcp_line(io.get_executor(), clock, settings);
    line->start(heard);
    line->stop();
    io.run();
    EXPECT_EQ(heard.ups, 0);
    EXPECT_THAT(heard.downs, IsEmpty());
}

TEST_F(TcpLineTest, AConnectionThatIsListenedToIsOnlyRead) {
    settings.listen_only = true;
    start();
    line->write("1F 03 00 64"_hex);
    const TimePoint end = clock.now() + 20ms;
    run_until([&] { return clock.now() > end; });
    EXPECT_EQ(peer->available(), 0u);
    EXPECT_EQ(line->counters().bytes_sent, 0u);
    expect_heard("1F 03 00 64"_hex);
}

TEST_F(TcpLineTest, TellsOnceOfTelnetAtTheStartOfAConnectionOnly) {
    const rt::LogTap log;
    start();
    expect_heard("FF FD 03"_hex);  // IAC DO suppress go ahead
    EXPECT_TRUE(line->counters().telnet);
    EXPECT_EQ(log.count("device server speaks telnet"), 1u);
    connect([this] { peer->close(); });
    EXPECT_FALSE(line->counters().telnet) << "not of this connection";
    heard.bytes.clear();
    expect_heard("FF 03 02 00 01"_hex);  // station 255
    heard.bytes.clear();
    expect_heard("FF FB 01"_hex);
    EXPECT_FALSE(line->counters().telnet) << "inside a connection anything may be data";
    connect([this] { peer->close(); });
    heard.bytes.clear();
    expect_heard("FF FB 01"_hex);
    EXPECT_TRUE(line->counters().telnet);
    EXPECT_EQ(log.count("device server speaks telnet"), 1u);
}

TEST_F(TcpLineTest, TellsOnceOfAServerThatHangsUpOnRequests) {
    const rt::LogTap log;
    start();
    for (int i = 1; i <= 5; ++i) {
        line->write("1F 03 00 64 00 01 C6 6B"_hex);
        connect([this] { peer->close(); });
        EXPECT_EQ(log.count("device server hangs up on requests"), i < 3 ? 0u : 1u) << i;
    }
}

TEST_F(TcpLineTest, AServerThatHangsUpWhileItIsIdleOrBehindAnAnswerIsLeftInPeace) {
    const rt::LogTap log;
    start();
    for (int i = 0; i < 4; ++i) connect([this] { peer->close(); });
    for (int i = 0; i < 4; ++i) {
        line->write("1F 03 00 64 00 01 C6 6B"_hex);
        heard.bytes.clear();
        expect_heard("1F 83 02 01 32"_hex);
        connect([this] { peer->close(); });
    }
    EXPECT_EQ(log.count("device server hangs up"), 0u);
}

// P7: a silent name server delays only the lines that need it.

/// Ends the silence when a test ends, however it ends.
struct Silence {
    Silence() {
        asked = 0;
        silent = true;
    }
    ~Silence() { end(); }
    void end() {
        silent = false;
        silent.notify_all();
    }
};

class Resolver : public TcpLineTest {
  protected:
    /// A line whose name server is silent.
    std::unique_ptr<Line> start_unknown() {
        auto unknown = make("moxa.invalid");
        unknown->start(unknown_heard);
        asked.wait(0);
        return unknown;
    }
    Heard unknown_heard;
    Silence silence;
};

TEST_F(Resolver, P7ASilentNameServerKeepsNoLineWaitingWhoseNameOrAddressIsKnown) {
    const auto unknown = start_unknown();
    for (const char* host : {"127.0.0.1", "moxa.plant"}) {
        heard.ups = 0;
        const auto known = make(host);
        known->start(heard);
        run_until([&] { return heard.ups == 1 || !unknown_heard.downs.empty(); });
        EXPECT_EQ(heard.ups, 1) << host;
        EXPECT_TRUE(asked == 1 || host == std::string_view("moxa.plant")) << "it needs no look-up";
    }
    EXPECT_EQ(unknown_heard.ups, 0);
    EXPECT_THAT(unknown_heard.downs, IsEmpty());
    silence.end();
    run_until([&] { return !unknown_heard.downs.empty(); });
    EXPECT_THAT(unknown_heard.downs[0], HasSubstr("cannot reach tcp://moxa.invalid:"));
}

TEST_F(Resolver, P7ALineIsGivenUpWhileItsNameServerIsSilent) {
    point_at("moxa.invalid");
    {
        boost::asio::io_context own{1};
        rt::AsioClock its_clock(own.get_executor());
        const auto unknown = make_tcp_line(own.get_executor(), its_clock, settings);
        unknown->start(heard);
        asked.wait(0);
        unknown->stop();
        own.run();  // nothing is left to wait for
    }
    EXPECT_EQ(heard.ups, 0);
    EXPECT_THAT(heard.downs, IsEmpty());
}

TEST_F(Resolver, ASilentNameServerIsReportedAndQueriedOnce) {
    point_at("moxa.invalid");
    test::ManualClock virtual_clock;
    const auto unknown = make_tcp_line(io.get_executor(), virtual_clock, settings);
    unknown->start(heard);
    asked.wait(0);
    for (int attempt = 0; attempt < 5; ++attempt) virtual_clock.advance(6s);
    EXPECT_THAT(heard.downs, ElementsAre(HasSubstr("no name server resolves its address")));
    EXPECT_EQ(asked, 1);
}

TEST_F(Resolver, ANumberInBracketsNeedsNoneEither) {
    error_code no_ipv6;
    acceptor.close();
    acceptor.open(tcp::v6(), no_ipv6);
    if (!no_ipv6) acceptor.bind({boost::asio::ip::address_v6::loopback(), 0}, no_ipv6);
    if (no_ipv6) GTEST_SKIP() << "no IPv6 here";
    acceptor.listen();
    line = make("[::1]");
    line->start(heard);
    run_until([&] { return heard.ups == 1; });
    EXPECT_EQ(asked, 0);
}

/// P1: a server that does not take written bytes, and what happens to them.
class UndeliveredTcp : public TcpLineTest {
  protected:
    UndeliveredTcp() { start(); }
    /// More than the server's window takes, and less than this end's socket buffer.
    void fill_the_window() {
        line->write(Bytes(kManyBytes, 0x55));
        run_until([&] { return line->undelivered(); });
    }
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
    EXPECT_THAT(heard.downs, IsEmpty());
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
    EXPECT_THAT(heard.downs, IsEmpty());
}

TEST_F(UndeliveredTcp, AServerThatReadsNothingDoesNotDeliverAndSeesTheReset) {
    EXPECT_FALSE(line->undelivered());
    const TimePoint begin = clock.now();
    fill_the_window();
    EXPECT_GE(clock.now() - begin, kDelayedAck);  // until then it may be on its way
    EXPECT_THAT(heard.downs, IsEmpty());
    line->reset("the request was not taken");
    EXPECT_THAT(heard.downs, ElementsAre(HasSubstr(" is opened anew: the request was not taken")));
    EXPECT_FALSE(line->undelivered());
    EXPECT_EQ(read_all(), boost::asio::error::connection_reset);
    EXPECT_LT(got.size(), kManyBytes);
}

TEST_F(UndeliveredTcp, TheNextConnectionCarriesNothingOfTheOneBefore) {
    fill_the_window();
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
    fill_the_window();
    line->write("01 02 03"_hex);
    EXPECT_THAT(heard.downs,
                ElementsAre(HasSubstr(" is opened anew: the connection takes nothing")));
    EXPECT_EQ(read_all(), boost::asio::error::connection_reset);
}

TEST_F(UndeliveredTcp, WhatHasNotArrivedIsDroppedWhenTheLineIsStopped) {
    fill_the_window();
    line->stop();
    EXPECT_THAT(heard.downs, IsEmpty());
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
}  // namespace panelgate::line::tcp_line_test
