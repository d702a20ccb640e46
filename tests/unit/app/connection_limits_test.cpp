#include "prepare.hpp"

#include <gtest/gtest.h>

namespace panelgate::app::connection_limits_test {
namespace {

class ConnectionLimits : public testing::Test {
  protected:
    ConnectionLimits() {
        config.lines.resize(2);
        config.modbus_tcp.resize(1);
        config.http.emplace();
    }
    std::size_t modbus() const { return config.modbus_tcp[0].max_connections; }
    std::size_t http() const { return config.http->max_connections; }
    config::Config config;
};

TEST_F(ConnectionLimits, StayWhereThereAreDescriptorsEnough) {
    const std::size_t enough = 1024 + 256 + kOwnDescriptors + 2 * kDescriptorsPerLine;
    EXPECT_EQ(fit_connections(config, enough), "");
    EXPECT_EQ(modbus(), 1024u);
    EXPECT_EQ(http(), 256u);
    EXPECT_NE(fit_connections(config, enough - 1), "");
}

TEST_F(ConnectionLimits, LeaveDevicesProbesAndTheLogTheirDescriptors) {
    EXPECT_EQ(fit_connections(config, 1024), "127.0.0.1:502 755, http 127.0.0.1:8080 188");
    EXPECT_LE(modbus() + http() + kOwnDescriptors + 2 * kDescriptorsPerLine, 1024u);
}

TEST_F(ConnectionLimits, LetSomebodyInEvenWithHardlyAny) {
    fit_connections(config, 64);
    EXPECT_EQ(modbus(), 12u);
    EXPECT_EQ(http(), 3u);
    config.http.reset();
    EXPECT_EQ(fit_connections(config, 64), "");
}

}  // namespace
}  // namespace panelgate::app::connection_limits_test
