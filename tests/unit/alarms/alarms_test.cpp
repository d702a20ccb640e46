#include "panelgate/alarms/alarms.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace panelgate::alarms {
namespace {

class AlarmsTest : public testing::Test {
  protected:
    static Alarms::Time at(int seconds) {
        return {TimePoint(std::chrono::seconds(seconds)), WallTime(std::chrono::seconds(seconds))};
    }
    static Settings hot(Duration delay = {}) {
        Settings hot;
        hot.name = "hot";
        hot.station = "oven";
        hot.point = "temperature";
        hot.above = 80;
        hot.back = 78;
        hot.delay = delay;
        return hot;
    }
    static std::string told(const std::optional<Change>& change) {
        if (!change) return "";
        return change->kind == Change::Kind::raised ? "raised" : "cleared";
    }
    std::string read(int second, std::optional<double> value) {
        return told(alarms.on_value(0, at(second), value));
    }
    std::string wait_until(int second) {
        const auto changes = alarms.on_time(at(second));
        return changes.empty() ? "" : told(changes.front());
    }
    State state() const { return alarms.status(0).state; }

    Alarms alarms;
};

TEST_F(AlarmsTest, EachTransitionOfTheFourStates) {
    alarms.apply({hot()});
    EXPECT_EQ(read(1, 81), "raised");
    EXPECT_EQ(state(), State::active);
    EXPECT_TRUE(alarms.acknowledge("hot", "mia"));
    EXPECT_EQ(state(), State::acknowledged);
    EXPECT_FALSE(alarms.acknowledge("hot", "tom")) << "somebody has";
    EXPECT_EQ(read(3, 70), "cleared");
    EXPECT_EQ(state(), State::normal) << "an acknowledged alarm that ends is over";
    EXPECT_FALSE(alarms.acknowledge("hot", "mia")) << "nothing to acknowledge";
    EXPECT_EQ(read(4, 81), "raised");
    EXPECT_EQ(read(5, 70), "cleared");
    EXPECT_EQ(state(), State::cleared) << "nobody has seen it";
    EXPECT_EQ(read(6, 90), "raised");
    EXPECT_EQ(read(7, 70), "cleared");
    EXPECT_TRUE(alarms.acknowledge("hot", "mia"));
    EXPECT_EQ(state(), State::normal);
    EXPECT_EQ(alarms.status(0), (Status{State::normal, at(7).wall, 70, "mia"}))
        << "since its end; acknowledging is no other time";
    EXPECT_FALSE(alarms.acknowledge("cold", "mia")) << "there is none of this name";
}

TEST_F(AlarmsTest, BetweenLimitAndBackNothingChanges) {
    alarms.apply({hot()});
    EXPECT_EQ(read(1, 79), "");
    EXPECT_EQ(read(2, 80.1), "raised");
    EXPECT_EQ(read(3, 79), "");
    EXPECT_EQ(read(4, 78), "cleared");
    EXPECT_EQ(read(5, 79), "");
}

TEST_F(AlarmsTest, WhatDoesNotHoldForItsDelayRaisesNothing) {
    alarms.apply({hot(10s)});
    EXPECT_EQ(read(0, 81), "");
    EXPECT_EQ(alarms.next(), at(10).now);
    EXPECT_EQ(read(5, 70), "") << "it flaps";
    EXPECT_FALSE(alarms.next());
    EXPECT_EQ(read(6, 81), "");
    EXPECT_EQ(wait_until(15), "");
    EXPECT_EQ(wait_until(16), "raised");
    EXPECT_FALSE(alarms.next());
}

TEST_F(AlarmsTest, AValueThatIsNotKnownNeitherRaisesNorClears) {
    alarms.apply({hot(10s)});
    read(0, 81);
    EXPECT_EQ(read(5, std::nullopt), "");
    EXPECT_EQ(wait_until(20), "");
    read(20, 81);
    EXPECT_EQ(read(30, 81), "raised");
    EXPECT_EQ(read(31, std::nullopt), "");
    EXPECT_EQ(state(), State::active);
}

TEST_F(AlarmsTest, EachKindOfConditionRaisesAndEnds) {
    std::vector<Settings> all(6);
    all[0] = {.name = "cold", .station = "oven", .point = "temperature", .below = 10};
    all[1] = {.name = "mode", .station = "oven", .point = "mode", .equals = 3};
    all[2] = {.name = "old", .station = "oven", .point = "mode", .stale = true};
    all[3] = {.name = "lost", .station = "oven", .offline = true};
    all[4] = {.name = "down", .line = "floor1", .down = true};
    all[5] = {.name = "wiring", .finding = "any"};
    alarms.apply(all);
    EXPECT_EQ(told(alarms.on_value(0, at(1), 11)), "");
    EXPECT_EQ(told(alarms.on_value(0, at(1), 9)), "raised");
    EXPECT_EQ(told(alarms.on_value(1, at(1), 3)), "raised");
    EXPECT_EQ(told(alarms.on_value(1, at(2), 4)), "cleared");
    EXPECT_EQ(told(alarms.on_value(2, at(1), 3)), "");
    EXPECT_EQ(told(alarms.on_value(2, at(2), std::nullopt)), "raised");
    for (const std::size_t i : {3U, 4U, 5U}) {
        EXPECT_EQ(told(alarms.on_condition(i, at(1), true)), "raised");
        EXPECT_EQ(told(alarms.on_condition(i, at(2), true)), "");
        EXPECT_EQ(told(alarms.on_condition(i, at(3), false)), "cleared");
    }
    EXPECT_EQ(alarms.find("down"), 4U);
}

TEST_F(AlarmsTest, AStateOutlivesARestartAndAReload) {
    for (const State before : {State::normal, State::active, State::acknowledged, State::cleared}) {
        Alarms again;
        again.apply({hot()});
        again.restore("hot", {before, at(1).wall, 81, "mia"});
        EXPECT_EQ(again.status(0).state, before);
        const bool active = again.status(0).is_active();
        EXPECT_EQ(told(again.on_value(0, at(5), 90)), active ? "" : "raised");
        again.apply({hot()});
        EXPECT_TRUE(again.status(0).is_active()) << "a reload that leaves it as it is";
        EXPECT_EQ(told(again.on_value(0, at(6), 20)), "cleared");
    }
    EXPECT_EQ(state_of(label(State::cleared)), State::cleared);
    EXPECT_FALSE(state_of("none"));
}

}  // namespace
}  // namespace panelgate::alarms
