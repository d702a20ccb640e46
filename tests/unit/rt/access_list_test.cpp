#include "panelgate/rt/acceptor.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace panelgate::rt::access_list_test {
namespace {

bool allows(const std::vector<Network>& networks, const char* peer) {
    return AccessList(networks).allows(boost::asio::ip::make_address(peer));
}

TEST(AccessList, AllowsEveryPeerWhenEmpty) {
    EXPECT_TRUE(allows({}, "192.0.2.1"));
    EXPECT_TRUE(allows({}, "2001:db8::1"));
}

TEST(AccessList, ComparesExactlyThePrefix) {
    EXPECT_TRUE(allows({{"192.168.10.0", 23}}, "192.168.11.255"));
    EXPECT_FALSE(allows({{"192.168.10.0", 23}}, "192.168.12.0"));
    EXPECT_TRUE(allows({{"10.1.2.3", 32}}, "10.1.2.3"));
    EXPECT_FALSE(allows({{"10.1.2.3", 32}}, "10.1.2.2"));
    EXPECT_TRUE(allows({{"2001:db8:8000::", 33}}, "2001:db8:ffff::1"));
    EXPECT_FALSE(allows({{"2001:db8:8000::", 33}}, "2001:db8:7fff::1"));
}

TEST(AccessList, IgnoresHostBitsOfTheNetwork) {
    EXPECT_TRUE(allows({{"10.1.2.3", 8}}, "10.200.0.1"));
}

TEST(AccessList, SeesAnIpv4PeerThroughAMappedAddress) {
    EXPECT_TRUE(allows({{"127.0.0.0", 8}}, "::ffff:127.0.0.1"));
    EXPECT_FALSE(allows({{"127.0.0.0", 8}}, "::ffff:128.0.0.1"));
    EXPECT_TRUE(allows({{"::ffff:10.0.0.0", 104}}, "10.9.8.7"));
    EXPECT_FALSE(allows({{"127.0.0.0", 8}}, "::1"));
}

TEST(AccessList, APrefixOfZeroMatchesItsAddressFamily) {
    EXPECT_TRUE(allows({{"0.0.0.0", 0}}, "203.0.113.9"));
    EXPECT_FALSE(allows({{"0.0.0.0", 0}}, "2001:db8::1"));
    EXPECT_TRUE(allows({{"::", 0}}, "203.0.113.9"));
}

TEST(AccessList, IsSatisfiedByAnyOfItsNetworks) {
    EXPECT_TRUE(allows({{"10.0.0.0", 8}, {"::1", 128}}, "::1"));
}

TEST(AccessList, RefusesWhatIsNotANetwork) {
    EXPECT_THROW(AccessList({{"floor1", 8}}), std::invalid_argument);
    EXPECT_THROW(AccessList({{"10.0.0.0", 33}}), std::invalid_argument);
    EXPECT_THROW(AccessList({{"::", 129}}), std::invalid_argument);
}

}  // namespace
}  // namespace panelgate::rt::access_list_test
