#include "panelgate/rt/acceptor.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

namespace panelgate::rt::acceptor_test {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

class AcceptorTest : public ::testing::Test {
  protected:
    tcp::socket connect() {
        tcp::socket client(io);
        client.connect({asio::ip::make_address("127.0.0.1"), acceptor.port()});
        return client;
    }
    void run_until_accepted(std::size_t count) {
        while (accepted.size() < count) io.run_one();
    }

    asio::io_context io{1};
    std::vector<tcp::socket> accepted;
    Acceptor acceptor{io.get_executor(),
                      [this](tcp::socket socket) { accepted.push_back(std::move(socket)); },
                      [](const error_code& why) { FAIL() << why.message(); }};
    Acceptor other{io.get_executor(), [](tcp::socket) {}, [](const error_code&) {}};
};

TEST_F(AcceptorTest, PassesOnEachConnectionUntilItIsClosed) {
    ASSERT_FALSE(acceptor.open("127.0.0.1", 0));
    const tcp::socket first = connect();
    const tcp::socket second = connect();
    run_until_accepted(2);
    EXPECT_EQ(accepted[0].remote_endpoint(), first.local_endpoint());
    EXPECT_EQ(accepted[1].remote_endpoint(), second.local_endpoint());
    const tcp::socket third = connect();
    acceptor.close();
    EXPECT_EQ(acceptor.port(), 0);
    io.run();
    EXPECT_EQ(accepted.size(), 2u);
}

TEST_F(AcceptorTest, ReturnsTheErrorAndCanBeOpenedOnceItsAddressIsThere) {
    EXPECT_EQ(acceptor.open("192.0.2.7", 0), std::errc::address_not_available);
    EXPECT_EQ(acceptor.port(), 0);
    ASSERT_FALSE(acceptor.open("127.0.0.1", 0));
    EXPECT_EQ(other.open("127.0.0.1", acceptor.port()), asio::error::address_in_use);
    EXPECT_EQ(other.port(), 0);
    EXPECT_EQ(other.open("no address", 0), asio::error::invalid_argument);
    const tcp::socket client = connect();
    run_until_accepted(1);
}

/// Like a gateway that listens on "0.0.0.0:502" and "[::]:502", in either order.
TEST_F(AcceptorTest, AllAddressesOfBothKindsHaveRoomOnOnePort) {
    if (other.open("::", 0, true)) GTEST_SKIP() << "no IPv6 here";
    // Another program may have the port in the other address family.
    for (int i = 0; i < 10 && acceptor.open("0.0.0.0", other.port()); ++i) {
        other.close();
        ASSERT_FALSE(other.open("::", 0, true));
    }
    ASSERT_EQ(acceptor.port(), other.port());
    other.close();
    EXPECT_FALSE(other.open("::", acceptor.port(), true));
}

TEST_F(AcceptorTest, AllAddressesOfIpv6AreThoseOfIpv4AsWell) {
    if (acceptor.open("::", 0)) GTEST_SKIP() << "no IPv6 here";
    const tcp::socket client = connect();
    run_until_accepted(1);
}

TEST(AccessList, AllowsPeersByThePrefixOfItsNetworks) {
    struct Row {
        std::vector<Network> networks;
        const char* peer;
        bool allowed;
    };
    const Row rows[] = {
        {{}, "192.0.2.1", true},  // an empty list allows every peer
        {{}, "2001:db8::1", true},
        {{{"192.168.10.0", 23}}, "192.168.11.255", true},
        {{{"192.168.10.0", 23}}, "192.168.12.0", false},
        {{{"10.1.2.3", 32}}, "10.1.2.3", true},
        {{{"10.1.2.3", 32}}, "10.1.2.2", false},
        {{{"2001:db8:8000::", 33}}, "2001:db8:ffff::1", true},
        {{{"2001:db8:8000::", 33}}, "2001:db8:7fff::1", false},
        {{{"10.1.2.3", 8}}, "10.200.0.1", true},  // host bits do not count
        // An IPv4 peer is seen through a mapped address.
        {{{"127.0.0.0", 8}}, "::ffff:127.0.0.1", true},
        {{{"127.0.0.0", 8}}, "::ffff:128.0.0.1", false},
        {{{"::ffff:10.0.0.0", 104}}, "10.9.8.7", true},
        {{{"127.0.0.0", 8}}, "::1", false},
        // A prefix of 0 matches its address family.
        {{{"0.0.0.0", 0}}, "203.0.113.9", true},
        {{{"0.0.0.0", 0}}, "2001:db8::1", false},
        {{{"::", 0}}, "203.0.113.9", true},
        {{{"10.0.0.0", 8}, {"::1", 128}}, "::1", true},  // any of them
    };
    for (const Row& row : rows)
        EXPECT_EQ(AccessList(row.networks).allows(asio::ip::make_address(row.peer)), row.allowed)
            << row.peer;
    for (const Network& bad : {Network{"floor1", 8}, Network{"10.0.0.0", 33}, Network{"::", 129}})
        EXPECT_THROW(AccessList({bad}), std::invalid_argument) << bad.address;
}

}  // namespace
}  // namespace panelgate::rt::acceptor_test
