#include "prepare.hpp"

#include <gtest/gtest.h>

namespace panelgate::app::address_families_test {
namespace {

class AddressFamilies : public testing::Test {
  protected:
    /// The setting of the last of these listeners.
    bool last_is_six_only() {
        separate_families(config);
        return config.modbus_tcp.back().ipv6_only;
    }
    void add(const char* address, std::uint16_t port) {
        config.modbus_tcp.emplace_back();
        config.modbus_tcp.back().address = address;
        config.modbus_tcp.back().port = port;
    }
    config::Config config;
};

TEST_F(AddressFamilies, AllAddressesOfIpv6AreThoseOfIpv4WhereNobodyElseHasThem) {
    add("0.0.0.0", 1502);
    add("::", 502);
    EXPECT_FALSE(last_is_six_only());
}

TEST_F(AddressFamilies, EachHasItsOwnKindOnOnePort) {
    add("0.0.0.0", 502);
    add("::", 502);
    EXPECT_TRUE(last_is_six_only());
    EXPECT_FALSE(config.modbus_tcp.front().ipv6_only);
    config.modbus_tcp.erase(config.modbus_tcp.begin());
    EXPECT_FALSE(last_is_six_only());
    config.http.emplace();
    config.http->port = 502;  // on 127.0.0.1
    EXPECT_TRUE(last_is_six_only());
}

TEST_F(AddressFamilies, AnyFreePortIsNeverTheSame) {
    add("127.0.0.1", 0);
    add("::", 0);
    EXPECT_FALSE(last_is_six_only());
}

}  // namespace
}  // namespace panelgate::app::address_families_test
