#include "panelgate/base/time.hpp"

#include <gtest/gtest.h>

namespace panelgate::wall_time_test {
namespace {

using namespace std::chrono;

TEST(WallTime, IsWrittenAsRfc3339WithMicroseconds) {
    const sys_days day = 2026y / November / 22;
    EXPECT_EQ(rfc3339(day + 7h + 5min + 9s + 250us), "2026-11-22T07:05:09.000250Z");
    EXPECT_EQ(rfc3339(sys_days(2024y / February / 29) + 23h + 59min + 59s + 999999us),
              "2024-02-29T23:59:59.999999Z");
    EXPECT_EQ(rfc3339(WallTime{}), "1970-01-01T00:00:00.000000Z");
}

TEST(WallTime, OfAMomentIsCountedBackFromNow) {
    const WallTime wall = sys_days(2026y / November / 22) + 1s;
    EXPECT_EQ(wall_time_of(TimePoint(5s), TimePoint(6s), wall), wall - 1s);
    EXPECT_EQ(wall_time_of(TimePoint(6s), TimePoint(5s), wall), wall + 1s);
}

}  // namespace
}  // namespace panelgate::wall_time_test
