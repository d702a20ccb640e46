#include <gtest/gtest.h>

#include <string>

#include "memory_files.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::config::relays_test {
namespace {

std::string with_relays(const std::string& relays) {
    return "lines:\n"
           "  - name: floor1\n"
           "    device: /dev/ttyUSB0\n"
           "    stations: [{id: 1, name: a}, {id: 2, name: b}]\n"
           "relays:\n" +
           relays + "modbus_tcp: [{listen: 127.0.0.1:502}]\n";
}

std::string relay(const std::string& from, unsigned source, const std::string& to, unsigned target,
                  unsigned count) {
    return "  - {from: " + from + '/' + std::to_string(400001 + source) + ", to: " + to + '/' +
           std::to_string(400001 + target) + ", count: " + std::to_string(count) + "}\n";
}

std::string problems_of(const std::string& relays) {
    yaml::Problems problems("relays.yaml");
    const MemoryFiles files({});
    const auto config = load(with_relays(relays), files, problems);
    EXPECT_EQ(config.has_value(), problems.empty());
    return problems.text();
}

TEST(ConfigRelays, AreReadWithTheirDefaults) {
    yaml::Problems problems("relays.yaml");
    const MemoryFiles files({});
    const auto config = load(
        with_relays(relay("a", 100, "b", 200, 8) + "  - {from: b/400300, to: a/400400, every: 5s, "
                                                   "on_change: true, refresh: 5min}\n"),
        files, problems);
    ASSERT_TRUE(config) << problems.text();
    ASSERT_EQ(config->relays.size(), 2U);
    const points::Relay& first = config->relays[0];
    EXPECT_EQ(first.from.station, "a");
    EXPECT_EQ(first.from.address, 100);
    EXPECT_EQ(first.to.station, "b");
    EXPECT_EQ(first.to.address, 200);
    EXPECT_EQ(first.count, 8U);
    EXPECT_EQ(first.every, 1s);
    EXPECT_FALSE(first.on_change);
    EXPECT_EQ(config->relays[1].count, 1U);
    EXPECT_EQ(config->relays[1].every, 5s);
    EXPECT_TRUE(config->relays[1].on_change);
    EXPECT_EQ(first.refresh, 60s);
    EXPECT_EQ(config->relays[1].refresh, 5min);
    EXPECT_TRUE(config->warnings.empty());
}

TEST(ConfigRelays, RefreshWithoutOnChangeHasNoEffectAndIsReported) {
    yaml::Problems problems("relays.yaml");
    const MemoryFiles files({});
    const auto config =
        load(with_relays("  - {from: a/400101, to: b/400201, refresh: 5s}\n"), files, problems);
    ASSERT_TRUE(config) << problems.text();
    ASSERT_EQ(config->warnings.size(), 1U);
    EXPECT_NE(config->warnings[0].find("refresh has no effect without on_change: true"),
              std::string::npos)
        << config->warnings[0];
    EXPECT_NE(problems_of("  - {from: a/400101, to: b/400201, on_change: true, refresh: 5}\n"), "");
}

TEST(ConfigRelays, AChainMayVisitAStationAgainElsewhere) {
    EXPECT_EQ(problems_of(relay("a", 0, "b", 0, 8) + relay("b", 0, "a", 100, 8) +
                          relay("a", 100, "b", 100, 8)),
              "");
}

/// Layers of three: one copies a block to two places, two merge them again: 2^60 paths.
TEST(ConfigRelays, ManyWaysThroughTheRelaysAreNotWalkedOneByOne) {
    std::string relays;
    for (unsigned layer = 60; layer-- > 0;) {  // backwards, so that each finds the rest
        const unsigned at = layer * 10;
        relays += relay("a", at, "b", at, 2);
        relays += relay("a", at, "b", at + 2, 2);
        relays += relay("b", at, "a", at + 10, 1);
        relays += relay("b", at + 2, "a", at + 11, 1);
    }
    EXPECT_EQ(problems_of(relays), "");
}

}  // namespace
}  // namespace panelgate::config::relays_test
