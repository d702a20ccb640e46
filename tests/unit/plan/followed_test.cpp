// What is said of many random lines holds.

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <initializer_list>
#include <random>
#include <string>

#include "panelgate/plan/line_plan.hpp"
#include "plant_line.hpp"

namespace panelgate::plan::followed_test {
namespace {

constexpr int kLines = 1500;

/// A line with any rate and format, with polls, points and relays.
class AnyLine : private test::PlantLine {
  public:
    explicit AnyLine(unsigned seed) : random_(seed) {
        line.serial.baud = pick({1200, 1800, 4800, 9600, 10000, 14400, 19200, 31250, 57600});
        line.serial.parity = pick({Parity::none, Parity::even});
        line.serial.stop_bits = pick({1, 2});
        line.serial.mode = pick({SerialMode::rtu, SerialMode::rtu, SerialMode::ascii});
        const int stations = number(2, 4);
        for (int i = 0; i < stations; ++i) add_station(i);
        const int relays = number(0, 4);
        for (int i = 0; i < relays; ++i) add_relay(static_cast<std::uint32_t>(i));
    }
    const Line& made() const { return line; }

  private:
    int number(int least, int most) { return std::uniform_int_distribution(least, most)(random_); }
    template <class T>
    T pick(std::initializer_list<T> from) {
        return from.begin()[number(0, static_cast<int>(from.size()) - 1)];
    }
    Duration interval() {
        return pick<Duration>({10ms, 33ms, 50ms, 100ms, 250ms, 1s, 2s, 7s, 29999us, 20h});
    }

    void add_station(int i) {
        Station& station = add("s" + std::to_string(i), pick({"generic", "panasonic-gt"}));
        station.think_time = pick<Duration>({0ms, 1ms, 5500us, 100ms});
        if (number(0, 2) == 0) station.frame_gap = pick<Duration>({0us, 500us, 3500us, 20ms});
        if (number(0, 1) == 0) show_as_written(station);
        const int asked = number(0, 5);
        for (int n = 0; n < asked; ++n) {
            const auto first = static_cast<std::uint32_t>(number(0, 30) * 20);
            const auto count = static_cast<std::uint32_t>(pick({1, 2, 8, 20, 60, 125, 300}));
            ask(station, first, count, interval());
        }
    }

    void add_relay(std::uint32_t index) {
        Relay& relay = copy(index * 4, pick({4u, 4u, 20u}), interval());
        if (number(0, 1) == 0) relay.refresh = pick<Duration>({1s, 2s, 10s, 60s});
        if (index > 0 && number(0, 1) == 0) {  // so that they continue one another
            relay.every = line.relays[index - 1].every;
            relay.refresh = line.relays[index - 1].refresh;
        }
        if (number(0, 4) == 0) relay.from.reset();
    }

    std::mt19937 random_;
};

TEST(RandomLines, WhatHelpsMakesALineFine) {
    int told = 0;
    for (unsigned seed = 0; seed < kLines; ++seed) {
        const AnyLine source(seed);
        Line any = source.made();
        const auto helps = advise(any, make_plan(any));
        EXPECT_FALSE(helps && verdict(make_plan(any)) == Verdict::fine);
        if (!helps) continue;
        SCOPED_TRACE("line " + std::to_string(seed) + ", " + helps->what);
        const double number = std::stod(helps->what.substr(helps->what.find_first_of("123456789")));
        if (helps->what.starts_with("serial: {baud: ")) {
            any.serial.baud = static_cast<int>(number);
        } else {
            ASSERT_TRUE(helps->what.starts_with("all intervals "));
            any = at_intervals(any, number);
        }
        const LinePlan after = make_plan(any);
        EXPECT_EQ(verdict(after), Verdict::fine);
        EXPECT_NEAR(helps->load, after.load, 1e-3 * after.load);
        EXPECT_NEAR(helps->most, after.most, 1e-3 * after.most);
        ++told;
    }
    EXPECT_GT(told, kLines / 3) << "of so many lines";
}

TEST(RandomLines, TheHighestRateIsFineAndTheNextIsNot) {
    for (unsigned seed = 0; seed < kLines / 5; ++seed) {
        const AnyLine any(seed);
        const auto highest = highest_rate(any.made(), make_plan(any.made()));
        if (!highest) continue;
        SCOPED_TRACE("line " + std::to_string(seed));
        const auto at = [&](double times) {
            return verdict(make_plan(at_intervals(any.made(), 1 / times)));
        };
        EXPECT_EQ(at(highest->times * 0.999), Verdict::fine);
        EXPECT_NE(at(highest->times * 1.001), Verdict::fine);
    }
}

}  // namespace
}  // namespace panelgate::plan::followed_test
