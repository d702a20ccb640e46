// P7: a name server that does not answer keeps only those lines waiting that need it.
#include <gtest/gtest.h>
#include <netdb.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <memory>
#include <string>

#include "line_events.hpp"
#include "panelgate/line/tcp_line.hpp"
#include "panelgate/rt/asio_clock.hpp"

namespace {

std::atomic<int> asked;
std::atomic<bool> silent;

}  // namespace

/// In place of the system's, for this whole program: the name server is silent until a test ends.
int getaddrinfo(const char*, const char*, const addrinfo*, addrinfo**) {
    ++asked;
    asked.notify_all();
    silent.wait(true);
    return EAI_AGAIN;
}

namespace panelgate::line {
namespace {

using boost::asio::ip::tcp;

std::unique_ptr<Line> make(boost::asio::io_context& io, rt::Clock& clock, const std::string& host,
                           const tcp::acceptor& acceptor) {
    Settings settings;
    settings.device = "tcp://" + host + ":" + std::to_string(acceptor.local_endpoint().port());
    return make_tcp_line(io.get_executor(), clock, settings);
}

TEST(Resolver, P7ALineWithANumericAddressDoesNotWaitForADeadNameServer) {
    asked = 0;
    silent = true;
    boost::asio::io_context io{1};
    rt::AsioClock clock(io.get_executor());
    tcp::acceptor acceptor(io, {boost::asio::ip::address_v4::loopback(), 0});
    Heard by_name;
    Heard by_number;
    const auto name = make(io, clock, "moxa.invalid", acceptor);
    const auto number = make(io, clock, "127.0.0.1", acceptor);
    name->start(by_name);
    asked.wait(0);  // all further questions would wait behind this one
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
}  // namespace panelgate::line
