#include "panelgate/web/http/message.hpp"

#include <gtest/gtest.h>

namespace panelgate::web::caller_test {
namespace {

TEST(Caller, NotifiesEachHandlerOnceThatItHasLeft) {
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

TEST(Caller, ThatHangsUpHasNotLeft) {
    Caller caller(7, "10.0.0.7");
    int told = 0;
    caller.at_leaving(&told, [&told] { ++told; });
    caller.hang_up();
    EXPECT_TRUE(caller.has_hung_up());
    EXPECT_FALSE(caller.has_left());
    caller.leave();
    EXPECT_TRUE(caller.has_left());
    EXPECT_EQ(told, 1);
}

TEST(Caller, IsCalledByItsAddressAndTheTokenOfItsLastRequest) {
    Caller caller(7, "10.0.0.9");
    EXPECT_EQ(caller.name(), "http 10.0.0.9");
    caller.uses_token("ops");
    EXPECT_EQ(caller.name(), "http 10.0.0.9 token ops");
    caller.uses_token("");
    EXPECT_EQ(caller.name(), "http 10.0.0.9");
    EXPECT_EQ(Caller(8, "").name(), "http");
}

}  // namespace
}  // namespace panelgate::web::caller_test
