#include "panelgate/line/tcp_line.hpp"

#include <gtest/gtest.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <functional>
#include <optional>

#include "panelgate/rt/asio_clock.hpp"
#include "support/hex.hpp"

namespace panelgate::line::tcp_line_test {
namespace {

using boost::asio::ip::tcp;

TEST(TcpDevice, IsAHostAndAPort) {
    const auto plain = parse_tcp_device("tcp://moxa.local:4001");
    ASSERT_TRUE(plain);
    EXPECT_EQ(plain->host, "moxa.local");
    EXPECT_EQ(plain->port, "4001");
    EXPECT_EQ(parse_tcp_device("tcp://[::1]:4001")->host, "::1");
    for (const char* text : {"tcp://", "tcp://host", "tcp://host:", "tcp://:4001", "tcp://host:0",
                             "tcp://host:65536", "tcp://host:40x", "tcp://::1:4001", "/dev/tty"}) {
        EXPECT_FALSE(parse_tcp_device(text)) << text;
    }
    EXPECT_EQ(parse_tcp_device("tcp://[fe80::1%eth0]:4001")->host, "fe80::1%eth0");
}

TEST(TcpDevice, ANumericAddressThatIsNoneIsNoName) {
    for (const char* host : {"10.0.0.300", "10.0.0", "10", "1.2.3.4.5", "[10.0.0.1]", "[fe80::g]",
                             "my host", "admin@moxa", "m\u00F6xa"})
        EXPECT_FALSE(parse_tcp_device("tcp://" + std::string(host) + ":4001")) << host;
    for (const char* host : {"10.0.0.30", "moxa-1", "1.plant.example", "rack_2"})
        EXPECT_TRUE(parse_tcp_device("tcp://" + std::string(host) + ":4001")) << host;
}

class TcpLineTest : public testing::Test, public Line::Events {
  protected:
    void on_up() override { ++ups; }
    void on_down(const std::string& text) override {
        ++downs;
        why = text;
    }
    void on_bytes(ByteView bytes) override {
        heard.insert(heard.end(), bytes.begin(), bytes.end());
    }

    void run_until(const std::function<bool()>& done) {
        io.restart();
        while (!done() && io.run_one() > 0) {
        }
        ASSERT_TRUE(done());
    }
    std::unique_ptr<Line> make(std::uint16_t port) {
        Settings settings;
        settings.device = "tcp://127.0.0.1:" + std::to_string(port);
        settings.reopen_min = 1ms;
        return make_tcp_line(io.get_executor(), clock, settings);
    }
    void accept() {
        peer.emplace(io);
        acceptor.async_accept(*peer, [this](auto error) { accepted = !error; });
    }

    boost::asio::io_context io{1};
    rt::AsioClock clock{io.get_executor()};
    tcp::acceptor acceptor{io, {boost::asio::ip::address_v4::loopback(), 0}};
    std::optional<tcp::socket> peer;
    bool accepted = false;
    int ups = 0;
    int downs = 0;
    std::string why;
    Bytes heard;
};

TEST_F(TcpLineTest, CarriesBytesBothWaysAndConnectsAgain) {
    accept();
    const auto line = make(acceptor.local_endpoint().port());
    line->start(*this);
    run_until([&] { return ups == 1 && accepted; });
    line->write("01 03 00 00"_hex);
    std::array<std::uint8_t, 4> got{};
    bool read = false;
    boost::asio::async_read(*peer, boost::asio::buffer(got),
                            [&](auto error, std::size_t) { read = !error; });
    run_until([&] { return read; });
    EXPECT_EQ(Bytes(got.begin(), got.end()), "01 03 00 00"_hex);
    boost::asio::write(*peer, boost::asio::buffer(Bytes{1, 3, 2}));
    run_until([&] { return heard.size() == 3; });
    EXPECT_GE(line->latency(), Duration::zero());
    EXPECT_LT(line->latency(), Duration(1s));

    accepted = false;
    peer.reset();
    run_until([&] { return downs == 1; });
    EXPECT_NE(why.find("is gone: hang-up"), std::string::npos) << why;
    accept();
    run_until([&] { return ups == 2 && accepted; });
    EXPECT_EQ(line->counters().reopens, 1u);
    line->stop();
    EXPECT_EQ(ups + downs, 3);
}

TEST_F(TcpLineTest, P7ReportsAClosedPortOnceAndRetries) {
    const std::uint16_t port = acceptor.local_endpoint().port();
    acceptor.close();
    const auto line = make(port);
    line->start(*this);
    run_until([&] { return downs == 1; });
    EXPECT_NE(why.find("cannot reach tcp://127.0.0.1:" + std::to_string(port)), std::string::npos);
    line->write("01"_hex);
    for (int i = 0; i < 20; ++i) io.run_one();
    EXPECT_EQ(downs, 1);
    acceptor = tcp::acceptor(io, {boost::asio::ip::address_v4::loopback(), port});
    accept();
    run_until([&] { return ups == 1; });
    line->stop();
}

TEST_F(TcpLineTest, CanBeStoppedWhileItConnects) {
    const auto line = make(acceptor.local_endpoint().port());
    line->start(*this);
    line->stop();
    io.run();
    EXPECT_EQ(ups + downs, 0);
}

}  // namespace
}  // namespace panelgate::line::tcp_line_test
