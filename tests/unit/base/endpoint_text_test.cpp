#include "panelgate/base/network.hpp"

#include <gtest/gtest.h>

namespace panelgate::endpoint_text_test {
namespace {

TEST(WithoutPort, CutsThePortOfAConnectionAndNothingElse) {
    EXPECT_EQ(without_port("10.0.0.7:50000"), "10.0.0.7");
    EXPECT_EQ(without_port("[::1]:50000"), "[::1]");
    EXPECT_EQ(without_port("modbus_tcp 10.0.0.7:50000"), "modbus_tcp 10.0.0.7");
    EXPECT_EQ(without_port("modbus_tcp [2001:db8::9]:5"), "modbus_tcp [2001:db8::9]");
    for (const char* whole : {"http ::1", "http 2001:db8::12", "http ::1 token bob", "mqtt", "",
                              "http 10.0.0.9 token a:1", "http 10.0.0.9 token b"})
        EXPECT_EQ(without_port(whole), whole);
}

}  // namespace
}  // namespace panelgate::endpoint_text_test
