#include "panelgate/config/endpoint.hpp"

#include <gtest/gtest.h>

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
}

TEST(Endpoint, KnowsTheAddressesThatAreAll) {
    for (const char* all : {"0.0.0.0", "::", "0::0", "0:0:0:0:0:0:0:0"})
        EXPECT_TRUE(is_any_address(all)) << all;
    for (const char* one : {"127.0.0.1", "::1", "0.0.0.1", ""}) EXPECT_FALSE(is_any_address(one));
}

TEST(Cidr, ReadsNetworksAndBareAddresses) {
    const auto network = parse_cidr("10.0.0.0/8");
    ASSERT_TRUE(network);
    EXPECT_EQ(network->address, "10.0.0.0");
    EXPECT_EQ(network->prefix, 8U);
    EXPECT_EQ(parse_cidr("192.168.1.7")->prefix, 32U);
    EXPECT_EQ(parse_cidr("::1")->prefix, 128U);
    EXPECT_EQ(parse_cidr("0.0.0.0/0")->prefix, 0U);
    EXPECT_EQ(parse_cidr("fd00::/8")->prefix, 8U);
    EXPECT_EQ(parse_cidr("::ffff:10.0.0.0/120")->prefix, 120U);
    EXPECT_EQ(parse_cidr("::ffff:10.0.0.1")->prefix, 128U);
}

TEST(Cidr, RefusesEverythingElse) {
    for (const char* text :
         {"", "/8", "10.0.0.0/", "10.0.0.0/33", "10.0.0.0/-1", "10.0.0.0/08", "::/129",
          "::ffff:10.0.0.0/24", "::ffff:10.0.0.0/95", "10.0.0/8", "host/8", "10.0.0.0/8/8"})
        EXPECT_FALSE(parse_cidr(text)) << text;
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

}  // namespace
}  // namespace panelgate::config::endpoint_test
