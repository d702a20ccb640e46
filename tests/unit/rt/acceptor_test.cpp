#include "panelgate/rt/acceptor.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <system_error>
#include <vector>

namespace panelgate::rt::acceptor_test {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

class AcceptorTest : public ::testing::Test {
  protected:
    tcp::socket connect(std::uint16_t port) {
        tcp::socket client(io);
        client.connect({asio::ip::make_address("127.0.0.1"), port});
        return client;
    }

    asio::io_context io{1};
    std::vector<tcp::socket> accepted;
    Acceptor acceptor{io.get_executor(),
                      [this](tcp::socket socket) { accepted.push_back(std::move(socket)); },
                      [](const error_code& why) { FAIL() << why.message(); }};
};

TEST_F(AcceptorTest, PassesOnEachConnection) {
    ASSERT_FALSE(acceptor.open("127.0.0.1", 0));
    const tcp::socket first = connect(acceptor.port());
    const tcp::socket second = connect(acceptor.port());
    while (accepted.size() < 2) io.run_one();
    EXPECT_EQ(accepted[0].remote_endpoint(), first.local_endpoint());
    EXPECT_EQ(accepted[1].remote_endpoint(), second.local_endpoint());
}

TEST_F(AcceptorTest, ReturnsTheErrorAndStaysClosed) {
    ASSERT_FALSE(acceptor.open("127.0.0.1", 0));
    Acceptor second(io.get_executor(), [](tcp::socket) {}, [](const error_code&) {});
    EXPECT_EQ(second.open("127.0.0.1", acceptor.port()), asio::error::address_in_use);
    EXPECT_EQ(second.port(), 0);
    EXPECT_EQ(second.open("no address", 0), asio::error::invalid_argument);
}

/// Like a gateway that listens on "0.0.0.0:502" and "[::]:502", in either order.
TEST_F(AcceptorTest, AllAddressesOfBothKindsHaveRoomOnOnePort) {
    Acceptor six(io.get_executor(), [](tcp::socket) {}, [](const error_code&) {});
    if (six.open("::", 0, true)) GTEST_SKIP() << "no IPv6 here";
    // Another program may have the port in the other address family.
    for (int i = 0; i < 10 && acceptor.open("0.0.0.0", six.port()); ++i) {
        six.close();
        ASSERT_FALSE(six.open("::", 0, true));
    }
    ASSERT_EQ(acceptor.port(), six.port());
    const std::uint16_t port = acceptor.port();
    six.close();
    EXPECT_FALSE(six.open("::", port, true));
}

TEST_F(AcceptorTest, AllAddressesOfIpv6AreThoseOfIpv4AsWell) {
    if (acceptor.open("::", 0)) GTEST_SKIP() << "no IPv6 here";
    const tcp::socket client = connect(acceptor.port());
    while (accepted.empty()) io.run_one();
}

TEST_F(AcceptorTest, CanBeOpenedOnceItsAddressIsThere) {
    EXPECT_EQ(acceptor.open("192.0.2.7", 0), std::errc::address_not_available);
    EXPECT_EQ(acceptor.port(), 0);
    EXPECT_FALSE(acceptor.open("127.0.0.1", 0));
    const tcp::socket client = connect(acceptor.port());
    while (accepted.empty()) io.run_one();
}

TEST_F(AcceptorTest, PassesOnNoConnectionOnceClosed) {
    ASSERT_FALSE(acceptor.open("127.0.0.1", 0));
    const tcp::socket client = connect(acceptor.port());
    acceptor.close();
    EXPECT_EQ(acceptor.port(), 0);
    io.run();
    EXPECT_TRUE(accepted.empty());
}

}  // namespace
}  // namespace panelgate::rt::acceptor_test
