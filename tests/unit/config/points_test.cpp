#include <gtest/gtest.h>

#include <map>
#include <string>

#include "memory_files.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::config::points_test {
namespace {

std::optional<Config> load_station(const std::string& keys) {
    yaml::Problems problems("points.yaml");
    const MemoryFiles files({});
    auto config = load(
        "lines:\n"
        "  - name: floor1\n"
        "    device: /dev/ttyUSB0\n"
        "    serial: {baud: 38400, data_bits: 8, parity: none, stop_bits: 1}\n"
        "    stations:\n"
        "      - {id: 31, name: press, profile: autonics-gplp-s, " +
            keys + "}\nmodbus_tcp: [{listen: 127.0.0.1:502}]\n",
        files, problems);
    EXPECT_TRUE(config) << problems.text();
    return config;
}

const Station& press(const Config& config) { return config.lines[0].stations[0]; }

TEST(ConfigPoints, FillsInTheDefaultsOfAPoint) {
    const auto config = load_station("points: [{name: a, at: UW100}, {name: b, at: UB180}]");
    ASSERT_TRUE(config);
    const auto& points = press(*config).points;
    ASSERT_EQ(points.size(), 2U);
    EXPECT_EQ(points[0].table, modbus::Table::holding_registers);
    EXPECT_EQ(points[0].address, 100);
    EXPECT_EQ(points[0].type, points::Type::u16);
    EXPECT_EQ(points[0].word_order, points::WordOrder::abcd);
    EXPECT_EQ(points[0].scale, 1);
    EXPECT_EQ(points[0].offset, 0);
    EXPECT_FALSE(points[0].writable);
    EXPECT_EQ(points[0].every, 1s);
    EXPECT_EQ(points[1].table, modbus::Table::coils);
    EXPECT_EQ(points[1].address, 288);
    EXPECT_EQ(points[1].type, points::Type::boolean);
    EXPECT_TRUE(press(*config).polls.empty());
    EXPECT_FALSE(press(*config).guard);
}

TEST(ConfigPoints, ReadsEveryKeyOfAPoint) {
    const auto config = load_station(
        "points: ["
        "{name: t_1-x, at: uw00102, type: i32, word_order: DCBA, scale: 0.5, offset: -3, unit: bar,"
        " min: -1.5, max: 400, writable: true, no_value: [-1, 7], every: 250ms},"
        "{name: mode, at: UW20, labels: {0: off, 10: 'on'}},"
        "{name: recipe, at: UW30, type: string, length: 5},"
        "{name: alarm, at: UW40, bit: 15}]");
    ASSERT_TRUE(config);
    const auto& points = press(*config).points;
    const points::Point& first = points[0];
    EXPECT_EQ(first.name, "t_1-x");
    EXPECT_EQ(first.at, "uw00102");
    EXPECT_EQ(first.address, 102);
    EXPECT_EQ(first.count(), 2U);
    EXPECT_EQ(first.type, points::Type::i32);
    EXPECT_EQ(first.word_order, points::WordOrder::dcba);
    EXPECT_EQ(first.scale, 0.5);
    EXPECT_EQ(first.offset, -3);
    EXPECT_EQ(first.unit, "bar");
    EXPECT_EQ(first.min, -1.5);
    EXPECT_EQ(first.max, 400);
    EXPECT_TRUE(first.writable);
    EXPECT_EQ(first.no_value, (std::vector<std::int64_t>{-1, 7}));
    EXPECT_EQ(first.every, 250ms);
    EXPECT_EQ(points[1].labels, (std::map<std::int64_t, std::string>{{0, "off"}, {10, "on"}}));
    EXPECT_EQ(points[2].length, 5U);
    EXPECT_EQ(points[2].count(), 3U);
    EXPECT_EQ(points[3].bit, 15U);
    EXPECT_EQ(points[3].type, points::Type::boolean);
}

TEST(ConfigPoints, ReadsPollsMaxAgeAndGuard) {
    const auto config = load_station(
        "guard: true, max_age: 2s, poll: [{read: UW0, count: 32, every: 5s}, "
        "{read: UB180}]");
    ASSERT_TRUE(config);
    const Station& station = press(*config);
    EXPECT_TRUE(station.guard);
    EXPECT_EQ(config->lines[0].arbiter.stations[0].max_age, 2s);
    ASSERT_EQ(station.polls.size(), 2U);
    EXPECT_EQ(station.polls[0].address, 0);
    EXPECT_EQ(station.polls[0].count, 32U);
    EXPECT_EQ(station.polls[0].every, 5s);
    EXPECT_EQ(station.polls[0].read, "UW0");
    EXPECT_EQ(station.polls[1].table, modbus::Table::coils);
    EXPECT_EQ(station.polls[1].count, 1U);
    EXPECT_EQ(station.polls[1].every, 1s);
}

TEST(ConfigPoints, MorePointsThanTheLimitAreRefusedAtOnce) {
    std::string points;
    for (std::size_t i = 0; i <= points::kMaxPoints; ++i)
        points += "{name: p" + std::to_string(i) + ", at: UW" + std::to_string(i) + "}, ";
    yaml::Problems problems("points.yaml");
    const MemoryFiles files({});
    EXPECT_FALSE(
        load("lines:\n  - name: a\n    device: sim\n"
             "    serial: {baud: 38400, parity: none}\n    stations:\n"
             "      - {id: 1, profile: autonics-gplp-s, points: [" +
                 points + "]}\nmodbus_tcp: [{listen: 127.0.0.1:502}]\n",
             files, problems));
    ASSERT_EQ(problems.list().size(), 1U);
    EXPECT_EQ(problems.list()[0].message, "at most 4096 points of one station, not 4097");
}

}  // namespace
}  // namespace panelgate::config::points_test
