#include "trace_book.hpp"

#include <gtest/gtest.h>

#include "panelgate/rt/clock.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::bus::wall_test {
namespace {

TEST(Wall, ShowsInstantsAsFarApartAsTheyAre) {
    test::ManualClock clock;
    Wall wall(clock);
    const WallTime before = rt::wall_now();
    const WallTime now = wall.at(clock.now());
    EXPECT_GE(now, before);
    EXPECT_LE(now, rt::wall_now());
    EXPECT_EQ(wall.at(clock.now() - 5ms), now - 5ms);
    EXPECT_EQ(wall.at(clock.now() + 99ms), now + 99ms);
}

TEST(Wall, AsksAgainNowAndThen) {
    test::ManualClock clock;
    Wall wall(clock);
    wall.at(clock.now());
    clock.pass(24h);
    EXPECT_LE(wall.at(clock.now()), rt::wall_now()) << "a day has passed for one of them only";
}

}  // namespace
}  // namespace panelgate::bus::wall_test
