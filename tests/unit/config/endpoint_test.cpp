#include "panelgate/config/endpoint.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace panelgate::config::endpoint_test {
namespace {

TEST(Endpoint, ReadsBothFamilies) {
    const auto v4 = parse_endpoint("127.0.0.1:502");
    ASSERT_TRUE(v4);
    EXPECT_EQ(v4->address, "127.0.0.1");
    EXPECT_EQ(v4->port, 502);
    const auto v6 = parse_endpoint("[fe80::1]:65535");
    ASSERT_TRUE(v6);
    EXPECT_EQ(v6->address, "fe80::1");
    EXPECT_EQ(v6->port, 65535);
    EXPECT_EQ(parse_endpoint("0.0.0.0:0")->port, 0);
}

TEST(Endpoint, RefusesEverythingElse) {
    for (const char* text :
         {"", ":502", "127.0.0.1", "127.0.0.1:", "127.0.0.1:65536", "127.0.0.1:-1",
          "127.0.0.1:0502", "127.0.0.1:5o2", "127.0.0.256:502", "127.1:502", "localhost:502",
          "::1:502", "[::1]", "[::1]:", "[127.0.0.1]:502", "[]:502", "[::1:502", " 127.0.0.1:502"})
        EXPECT_FALSE(parse_endpoint(text)) << text;
    for (const char* text :
         {"", "/8", "10.0.0.0/", "10.0.0.0/33", "10.0.0.0/-1", "10.0.0.0/08", "::/129",
          "::ffff:10.0.0.0/24", "::ffff:10.0.0.0/95", "10.0.0/8", "host/8", "10.0.0.0/8/8"})
        EXPECT_FALSE(parse_cidr(text)) << text;
}

TEST(Cidr, ReadsNetworksAndBareAddresses) {
    EXPECT_EQ(parse_cidr("10.0.0.0/8").value().address, "10.0.0.0");
    EXPECT_EQ(parse_cidr("10.0.0.0/8")->prefix, 8U);
    EXPECT_EQ(parse_cidr("192.168.1.7")->prefix, 32U);
    EXPECT_EQ(parse_cidr("::1")->prefix, 128U);
    EXPECT_EQ(parse_cidr("0.0.0.0/0")->prefix, 0U);
    EXPECT_EQ(parse_cidr("fd00::/8")->prefix, 8U);
    EXPECT_EQ(parse_cidr("::ffff:10.0.0.0/120")->prefix, 120U);
    EXPECT_EQ(parse_cidr("::ffff:10.0.0.1")->prefix, 128U);
}

TEST(Endpoint, AnAddressIsInANetworkWhateverTheirSpelling) {
    EXPECT_TRUE(is_in("127.0.0.1", "127.0.0.0", 8));
    EXPECT_TRUE(is_in("127.0.0.1", "::", 0));
    EXPECT_TRUE(is_in("127.0.0.1", "::ffff:127.0.0.0", 104));
    EXPECT_TRUE(is_in("::1", "::1", 128));
    EXPECT_FALSE(is_in("127.0.0.1", "128.0.0.0", 8));
    EXPECT_FALSE(is_in("::1", "0.0.0.0", 0));
    EXPECT_FALSE(is_in("::2", "::1", 128));
    EXPECT_FALSE(is_in("here", "0.0.0.0", 0));
}

TEST(Endpoint, KnowsTheAddressesThatAreAllAndThoseThatOnlyThisMachineReaches) {
    for (const char* all : {"0.0.0.0", "::", "0::0", "0:0:0:0:0:0:0:0"})
        EXPECT_TRUE(is_any_address(all)) << all;
    for (const char* one : {"127.0.0.1", "::1", "0.0.0.1", ""}) EXPECT_FALSE(is_any_address(one));
    for (const char* own : {"127.0.0.1", "127.1.2.3", "::1", "::ffff:127.0.0.1"})
        EXPECT_TRUE(is_loopback(own)) << own;
    for (const char* other : {"0.0.0.0", "::", "192.168.1.5", "::2", "localhost"})
        EXPECT_FALSE(is_loopback(other)) << other;
}

TEST(Endpoint, AllAddressesOfTheMachineAreReachedOnLoopbackAndOneAtItself) {
    EXPECT_EQ(reachable("0.0.0.0"), "127.0.0.1");
    EXPECT_EQ(reachable("::"), "::1");
    EXPECT_EQ(reachable("0:0::0"), "::1");
    for (const std::string one : {"192.0.2.7", "2001:db8::7"}) EXPECT_EQ(reachable(one), one);
}

TEST(Endpoint, IsReachableFromOutsideUnlessItIsLoopbackOrAllowsKnownNetworks) {
    for (const char* address : {"0.0.0.0", "::", "192.168.1.5", "2001:db8::7"}) {
        EXPECT_TRUE(is_reachable_from_outside(address, {})) << address;
        EXPECT_FALSE(is_reachable_from_outside(address, {{"192.168.10.0", 24}, {"fd00::", 8}}));
    }
    EXPECT_FALSE(is_reachable_from_outside("127.0.0.1", {}));
    EXPECT_FALSE(is_reachable_from_outside("::1", {{"::", 0}}));
}

TEST(Endpoint, IsReachableFromOutsideByNetworksThatTogetherArePublicAndWide) {
    const auto open = [](const std::vector<Network>& allow) {
        return is_reachable_from_outside("0.0.0.0", allow);
    };
    EXPECT_TRUE(open({{"10.0.0.0", 8}, {"0.0.0.0", 0}}));
    EXPECT_TRUE(open({{"0.0.0.0", 1}, {"128.0.0.0", 1}}));
    EXPECT_TRUE(open({{"::", 0}}));
    EXPECT_TRUE(open({{"52.0.0.0", 7}}));
    EXPECT_TRUE(open({{"52.0.0.0", 8}, {"54.0.0.0", 8}}));
    EXPECT_FALSE(open({{"52.0.0.0", 8}, {"52.0.0.0", 8}, {"52.1.0.0", 16}})) << "one of them";
    EXPECT_FALSE(open({{"10.0.0.0", 8}, {"172.16.0.0", 12}, {"192.168.0.0", 16}})) << "private";
    EXPECT_TRUE(open({{"10.0.0.0", 7}})) << "half of it is public";
}

TEST(Endpoint, IsReachableFromOutsideByTheNetworksOfItsOwnFamily) {
    EXPECT_TRUE(is_reachable_from_outside("2001:db8::7", {{"2000::", 3}}));
    EXPECT_TRUE(is_reachable_from_outside("::", {{"2000::", 3}}));
    EXPECT_FALSE(is_reachable_from_outside("192.168.1.5", {{"2000::", 3}}));
    EXPECT_FALSE(is_reachable_from_outside("2001:db8::7", {{"0.0.0.0", 0}}));
    EXPECT_TRUE(is_reachable_from_outside("::", {{"0.0.0.0", 0}})) << "takes both";
    EXPECT_FALSE(is_reachable_from_outside("2001:db8::7", {{"2001::", 16}}));
    EXPECT_FALSE(is_reachable_from_outside("2001:db8::7", {{"fc00::", 7}}));
}

}  // namespace
}  // namespace panelgate::config::endpoint_test
