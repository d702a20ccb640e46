#include "panelgate/web/http/caller.hpp"

#include <gtest/gtest.h>

namespace panelgate::web {
namespace {

TEST(Caller, TellsWhoeverWorksForItOnceThatItHasLeft) {
    Caller caller(7, "10.0.0.7");
    int first = 0;
    int second = 0;
    EXPECT_TRUE(caller.at_leaving(&first, [&first] { ++first; }));
    EXPECT_FALSE(caller.at_leaving(&first, [&first] { first += 10; }));
    EXPECT_TRUE(caller.at_leaving(&second, [&] { second += caller.has_left() ? 1 : 0; }));
    EXPECT_FALSE(caller.has_left());
    caller.leave();
    caller.leave();
    EXPECT_TRUE(caller.has_left());
    EXPECT_EQ(first, 1);
    EXPECT_EQ(second, 1);
}

}  // namespace
}  // namespace panelgate::web
