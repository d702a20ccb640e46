// P7: a silent name server delays only the lines that need it.
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <netdb.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <memory>
#include <string>
#include <string_view>

#include "line_events.hpp"
#include "panelgate/line/tcp_line.hpp"
#include "panelgate/rt/asio_clock.hpp"
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

namespace panelgate::line::resolver_test {
namespace {

using boost::asio::ip::tcp;

std::unique_ptr<Line> make(boost::asio::io_context& io, rt::Clock& clock, const std::string& host,
                           const tcp::acceptor& acceptor) {
    Settings settings;
    settings.device = "tcp://" + host + ":" + std::to_string(acceptor.local_endpoint().port());
    return make_tcp_line(io.get_executor(), clock, settings);
}

/// Ends the silence when a test ends, however it ends.
struct Silence {
    Silence() {
        asked = 0;
        silent = true;
    }
    ~Silence() {
        silent = false;
        silent.notify_all();
    }
};

TEST(Resolver, P7ASilentNameServerKeepsNoLineWaitingWhoseNameIsKnown) {
    const Silence silence;
    boost::asio::io_context io{1};
    rt::AsioClock clock(io.get_executor());
    tcp::acceptor acceptor(io, {boost::asio::ip::address_v4::loopback(), 0});
    Heard unknown_heard;
    Heard known_heard;
    const auto unknown = make(io, clock, "moxa.invalid", acceptor);
    const auto known = make(io, clock, "moxa.plant", acceptor);
    unknown->start(unknown_heard);
    asked.wait(0);
    known->start(known_heard);
    while (known_heard.ups == 0 && unknown_heard.downs.empty()) io.run_one();
    EXPECT_EQ(known_heard.ups, 1);
    EXPECT_TRUE(unknown_heard.downs.empty()) << unknown_heard.downs[0];
}

TEST(Resolver, P7ALineIsGivenUpWhileItsNameServerIsSilent) {
    const Silence silence;
    Heard heard;
    {
        boost::asio::io_context io{1};
        rt::AsioClock clock(io.get_executor());
        tcp::acceptor acceptor(io, {boost::asio::ip::address_v4::loopback(), 0});
        const auto line = make(io, clock, "moxa.invalid", acceptor);
        line->start(heard);
        asked.wait(0);
        line->stop();
        io.run();  // nothing is left to wait for
    }
    EXPECT_EQ(heard.ups, 0);
    EXPECT_TRUE(heard.downs.empty());
}

TEST(Resolver, ASilentNameServerIsReportedAndQueriedOnce) {
    Heard heard;
    const Silence silence;
    test::ManualClock clock;
    boost::asio::io_context io{1};
    tcp::acceptor acceptor(io, {boost::asio::ip::address_v4::loopback(), 0});
    const auto line = make(io, clock, "moxa.invalid", acceptor);
    line->start(heard);
    asked.wait(0);
    for (int attempt = 0; attempt < 5; ++attempt) clock.advance(6s);
    ASSERT_EQ(heard.downs.size(), 1u);
    EXPECT_NE(heard.downs[0].find("no name server resolves its address"), std::string::npos);
    EXPECT_EQ(asked, 1);
    line->stop();
}

TEST(Resolver, P7ALineWithANumericAddressDoesNotWaitForADeadNameServer) {
    Silence silence;
    boost::asio::io_context io{1};
    rt::AsioClock clock(io.get_executor());
    tcp::acceptor acceptor(io, {boost::asio::ip::address_v4::loopback(), 0});
    Heard by_name;
    Heard by_number;
    const auto name = make(io, clock, "moxa.invalid", acceptor);
    const auto number = make(io, clock, "127.0.0.1", acceptor);
    name->start(by_name);
    asked.wait(0);
    number->start(by_number);
    while (by_number.ups == 0 && by_name.downs.empty()) io.run_one();
    EXPECT_EQ(by_number.ups, 1);
    EXPECT_EQ(asked, 1);
    EXPECT_EQ(by_name.ups, 0);
    silent = false;
    silent.notify_all();
    while (by_name.downs.empty()) io.run_one();
    EXPECT_NE(by_name.downs[0].find("cannot reach tcp://moxa.invalid:"), std::string::npos);
}

TEST(Resolver, ANumberInBracketsNeedsNoneEither) {
    boost::asio::io_context io{1};
    rt::AsioClock clock(io.get_executor());
    boost::system::error_code no_ipv6;
    tcp::acceptor six(io);
    six.open(tcp::v6(), no_ipv6);
    if (!no_ipv6) six.bind({boost::asio::ip::address_v6::loopback(), 0}, no_ipv6);
    if (no_ipv6) GTEST_SKIP() << "no IPv6 here";
    six.listen();
    Heard heard;
    const int before = asked;
    const auto line = make(io, clock, "[::1]", six);
    line->start(heard);
    while (heard.ups == 0) io.run_one();
    EXPECT_EQ(asked, before);
}

}  // namespace
}  // namespace panelgate::line::resolver_test
