// Times on the wire, wall-clock time, and numbers kept by time.
#include "panelgate/base/time.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <utility>
#include <vector>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/series.hpp"

namespace panelgate::time_test {
namespace {

SerialFormat even(int baud) { return {baud, 8, Parity::even, 1}; }
SerialFormat plain(int baud) { return {baud, 8, Parity::none, 1}; }
SerialFormat ascii(int baud) { return {baud, 7, Parity::even, 1, SerialMode::ascii}; }

/// Milliseconds as the table prints them: equal to the last digit printed.
void expect_milliseconds(Duration time, double printed, double last_digit) {
    EXPECT_NEAR(to_milliseconds(time), printed, last_digit * 0.51);
}

struct Row {
    int baud;
    double character_11, character_10, silence, request_8, reply_25, reply_255, longest_256;
};

/// 11 (10) bits a character; 3.5 characters of silence, 1.750 ms above 19200 (V1.02, 2.5.1.1).
constexpr Row kRows[] = {
    {1200, 9.1667, 8.3333, 32.083, 73.333, 229.167, 2337.500, 2346.667},
    {2400, 4.5833, 4.1667, 16.042, 36.667, 114.583, 1168.750, 1173.333},
    {4800, 2.2917, 2.0833, 8.021, 18.333, 57.292, 584.375, 586.667},
    {9600, 1.1458, 1.0417, 4.010, 9.167, 28.646, 292.188, 293.333},
    {14400, 0.7639, 0.6944, 2.674, 6.111, 19.097, 194.792, 195.556},
    {19200, 0.5729, 0.5208, 2.005, 4.583, 14.323, 146.094, 146.667},
    {38400, 0.2865, 0.2604, 1.750, 2.292, 7.161, 73.047, 73.333},
    {57600, 0.1910, 0.1736, 1.750, 1.528, 4.774, 48.698, 48.889},
    {115200, 0.0955, 0.0868, 1.750, 0.764, 2.387, 24.349, 24.444},
};

TEST(SerialFormat, HasTheTimesOfTheTable) {
    for (const Row& row : kRows) {
        SCOPED_TRACE(row.baud);
        const SerialFormat format = even(row.baud);
        expect_milliseconds(character_time(format), row.character_11, 0.0001);
        expect_milliseconds(character_time(plain(row.baud)), row.character_10, 0.0001);
        expect_milliseconds(silent_interval(format), row.silence, 0.001);
        expect_milliseconds(wire_time(format, 8), row.request_8, 0.001);
        expect_milliseconds(wire_time(format, 25), row.reply_25, 0.001);
        expect_milliseconds(wire_time(format, 255), row.reply_255, 0.001);
        expect_milliseconds(wire_time(format, 256), row.longest_256, 0.001);
    }
    EXPECT_EQ(wire_time(even(9600), 0), 0ns);
}

TEST(SerialFormat, Counts10BitsWithoutParity) {
    const SerialFormat format = plain(38400);
    expect_milliseconds(wire_time(format, 8), 2.0833, 0.0001);
    expect_milliseconds(wire_time(format, 25), 6.5104, 0.0001);
    expect_milliseconds(wire_time(format, 255), 66.4062, 0.0001);
    EXPECT_EQ(silent_interval(format), 1750us);
    EXPECT_EQ(silent_interval(even(19201)), 1750us);
    EXPECT_LT(silent_interval(plain(9600)), silent_interval(even(9600))) << "by the real character";
    EXPECT_EQ(even(9600).bits_per_character(), 11);
    EXPECT_EQ(plain(9600).bits_per_character(), 10);
    EXPECT_EQ((SerialFormat{9600, 8, Parity::none, 2}).bits_per_character(), 11);
    EXPECT_EQ((SerialFormat{9600, 7, Parity::odd, 1}).bits_per_character(), 10);
}

TEST(SerialFormat, IsWrittenAsPeopleWriteIt) {
    EXPECT_EQ(to_string(SerialFormat()), "19200 8E1") << "the standard's by default";
    EXPECT_EQ(to_string(plain(38400)), "38400 8N1");
    EXPECT_EQ(to_string({9600, 8, Parity::odd, 2}), "9600 8O2");
    EXPECT_EQ(to_string(ascii(9600)), "9600 7E1 ASCII");
}

TEST(SerialFormat, AFrameOfAsciiTakesTwoCharactersAByteAndOneBesides) {
    const SerialFormat rtu = even(9600);
    EXPECT_EQ(frame_time(rtu, 8), wire_time(rtu, 8));
    EXPECT_EQ(frame_time(ascii(9600), 8), wire_time(ascii(9600), 17));
    EXPECT_EQ(frame_time(ascii(9600), 8 + 11, 2), wire_time(ascii(9600), 17 + 23));
    EXPECT_EQ(byte_time(rtu), character_time(rtu));
    EXPECT_EQ(byte_time(ascii(9600)), wire_time(ascii(9600), 2));
    // The silence is the time to turn round only.
    EXPECT_EQ(silent_interval(ascii(1200)), wire_time(ascii(1200), 2));
    EXPECT_EQ(silent_interval(ascii(115200)), 1ms);
}

TEST(WallTime, IsWrittenAsRfc3339WithMicroseconds) {
    using namespace std::chrono;
    const sys_days day = 2026y / November / 22;
    EXPECT_EQ(rfc3339(day + 7h + 5min + 9s + 250us), "2026-11-22T07:05:09.000250Z");
    EXPECT_EQ(rfc3339(sys_days(2024y / February / 29) + 23h + 59min + 59s + 999999us),
              "2024-02-29T23:59:59.999999Z");
    EXPECT_EQ(rfc3339(WallTime{}), "1970-01-01T00:00:00.000000Z");
    // A moment's is counted back from now.
    const WallTime wall = day + 1s;
    EXPECT_EQ(wall_time_of(TimePoint(5s), TimePoint(6s), wall), wall - 1s);
    EXPECT_EQ(wall_time_of(TimePoint(6s), TimePoint(5s), wall), wall + 1s);
}

using Values = std::vector<std::pair<int, double>>;  // at seconds

constexpr TimePoint kStart{100s};

/// Ring 1 has four slots of 10 s; times are relative to kStart. The rings beside are full.
SlotRings ring_of(const Values& put) {
    SlotRings rings(10s, 4, 3);
    for (const auto& [at, value] : put) rings.put(1, kStart + at * 1s, value);
    for (const int at : {0, 10, 20, 30, 100}) {
        rings.put(0, kStart + at * 1s, -1);
        rings.put(2, kStart + at * 1s, -1);
    }
    return rings;
}

Values told(const Values& put, int now) {
    Values all;
    ring_of(put).each(1, kStart + now * 1s, [&](TimePoint at, double value) {
        all.emplace_back(static_cast<int>((at - kStart) / 1s), value);
    });
    return all;
}

TEST(SlotRings, KeepsTheLastValueOfEachSlot) {
    EXPECT_EQ(told({}, 0), Values());
    EXPECT_FALSE(ring_of({}).at(1, kStart));
    const Values put{{0, 1}, {9, 2}, {10, 0}};
    EXPECT_EQ(told(put, 10), (Values{{0, 2}, {10, 0}}));
    EXPECT_EQ(ring_of(put).at(1, kStart + 5s), 2);
    EXPECT_EQ(ring_of(put).at(1, kStart + 19s), 0);
    EXPECT_FALSE(ring_of(put).at(1, kStart + 20s));
    EXPECT_FALSE(ring_of(put).at(1, kStart - 1s));
}

TEST(SlotRings, P10AnUnsetSlotIsAbsentAndNever0) {
    EXPECT_EQ(told({{0, 1}, {30, 4}}, 30), (Values{{0, 1}, {30, 4}}));
    EXPECT_FALSE(ring_of({{0, 1}, {30, 4}}).at(1, kStart + 15s));
}

TEST(SlotRings, ForgetsTheOldest) {
    Values put{{0, 0}, {10, 1}, {20, 2}, {30, 3}, {40, 4}, {50, 5}};
    EXPECT_EQ(told(put, 50), (Values{{20, 2}, {30, 3}, {40, 4}, {50, 5}}));
    put.emplace_back(15, 9);
    EXPECT_EQ(told(put, 50).size(), 4u) << "too late";
    put.emplace_back(25, 9);
    EXPECT_EQ(told(put, 50), (Values{{20, 9}, {30, 3}, {40, 4}, {50, 5}}));
    // Time alone makes old.
    EXPECT_EQ(told({{0, 1}, {20, 3}}, 39), (Values{{0, 1}, {20, 3}}));
    EXPECT_EQ(told({{0, 1}, {20, 3}}, 40), (Values{{20, 3}}));
    EXPECT_EQ(told({{0, 1}, {20, 3}}, 60), Values());
    EXPECT_EQ(told({{0, 1}, {20, 3}, {100, 7}}, 100), (Values{{100, 7}}));
}

TEST(SlotRings, KnowsNothingOfBeforeTheClockBegan) {
    SlotRings young(10s, 7, 1);
    std::vector<double> values;
    young.put(0, TimePoint{15s}, 1);
    young.put(0, TimePoint{25s}, 2);
    young.each(0, TimePoint{25s}, [&](TimePoint, double value) { values.push_back(value); });
    EXPECT_EQ(values, (std::vector<double>{1, 2}));
}

TEST(SlotRings, ARingIsTakenOver) {
    const SlotRings before = ring_of({{0, 1}, {10, 2}});
    SlotRings rings(10s, 4, 2);
    rings.copy(1, before, 1);
    rings.put(1, kStart + 20s, 3);
    Values all;
    rings.each(1, kStart + 20s, [&](TimePoint at, double value) {
        all.emplace_back(static_cast<int>((at - kStart) / 1s), value);
    });
    EXPECT_EQ(all, (Values{{0, 1}, {10, 2}, {20, 3}}));
    EXPECT_FALSE(rings.at(0, kStart));
}

TEST(SlotWidth, IsTheNarrowestThatStaysBelowTheLimit) {
    constexpr std::size_t kHour = 3600 * SlotRings::kBytes;
    EXPECT_EQ(slot_width(1, 1h, 1s, kHour), 1s);
    EXPECT_EQ(slot_width(2, 1h, 1s, kHour), 2s);
    EXPECT_EQ(slot_width(3, 1h, 1s, kHour), 5s);
    EXPECT_EQ(slot_width(1, 1h, 5s, kHour), 5s);
    EXPECT_EQ(slot_width(0, 1h, 1s, 0), 1s);
    EXPECT_EQ(slot_width(1'000'000, 1h, 1s, kHour), 600s);
}

}  // namespace
}  // namespace panelgate::time_test
