#include "panelgate/config/endpoint.hpp"

#include <gtest/gtest.h>

namespace panelgate::config::reachable_test {
namespace {

TEST(Reachable, AllAddressesOfTheMachineAreReachedOnLoopback) {
    EXPECT_EQ(reachable("0.0.0.0"), "127.0.0.1");
    EXPECT_EQ(reachable("::"), "::1");
    EXPECT_EQ(reachable("0:0::0"), "::1");
}

TEST(Reachable, OneAddressIsReachedAtItself) {
    EXPECT_EQ(reachable("192.0.2.7"), "192.0.2.7");
    EXPECT_EQ(reachable("2001:db8::7"), "2001:db8::7");
}

}  // namespace
}  // namespace panelgate::config::reachable_test
