#include "key_book.hpp"

#include <gtest/gtest.h>

namespace panelgate::web::patience_test {
namespace {

TEST(Patience, IsTheLessOfWhatTheLineAndItsClientHave) {
    TimePoint now{1h};
    const std::function<TimePoint()> clock = [&] { return now; };
    HttpRequest request;
    const Patience whole(request, 2s, clock);
    request.headers["prefer"] = "wait=1";
    const Patience half(request, 2s, clock);
    now += 600ms;
    EXPECT_EQ(whole.left(), 1400ms);
    EXPECT_EQ(half.left(), 400ms);
    now += 600ms;
    EXPECT_EQ(half.left(), 0s);
}

TEST(Patience, WhatIsNoWaitIsNoWish) {
    EXPECT_EQ(wait_of(""), std::nullopt);
    EXPECT_EQ(wait_of("respond-async"), std::nullopt);
    EXPECT_EQ(wait_of("wait"), std::nullopt);
    EXPECT_EQ(wait_of("wait=-1"), std::nullopt);
    EXPECT_EQ(wait_of("waiting=1"), std::nullopt);
    EXPECT_EQ(wait_of("handling=strict , wait = 7 ; foo=\"bar\""), 7s);
    EXPECT_EQ(wait_of("wait=0"), 0s);
    EXPECT_EQ(wait_of("wait=4000000000"), 24h);
}

}  // namespace
}  // namespace panelgate::web::patience_test
