#include "body.hpp"

#include <gtest/gtest.h>

#include <string>

namespace panelgate::web::repeated_member_test {
namespace {

TEST(RepeatedMember, IsFoundAtAnyDepth) {
    EXPECT_EQ(find_repeated_member(R"({"values":[1],"values":[2]})").value().name, "values");
    EXPECT_EQ(find_repeated_member(R"([{"x":{"a":1,"b":[{"c":1,"d":2,"c":3}]}}])").value().name,
              "c");
    EXPECT_EQ(find_repeated_member(R"({"a":1,"\u0061":2})").value().name, "a") << "two spellings";
}

TEST(RepeatedMember, TheSameNameInAnotherObjectOrCaseIsAnother) {
    EXPECT_FALSE(find_repeated_member(R"({"a":{"a":[{"a":1},{"a":2}]},"A":1})"));
    EXPECT_FALSE(find_repeated_member(R"(["a","a"])"));
    EXPECT_FALSE(find_repeated_member("{}"));
}

TEST(RepeatedMember, TellsWhereTheSecondOneBegins) {
    const std::string text = R"({"a":1, "a":2})";
    EXPECT_EQ(find_repeated_member(text).value().at, text.rfind("\"a\""));
}

TEST(RepeatedMember, WhatIsNoJsonHasNoneBehindItsFault) {
    for (const char* text : {"", "{", "[1,,2]", R"({"a":1 x "a":2})", R"({"a":1,"a)"}) {
        EXPECT_FALSE(find_repeated_member(text)) << text;
    }
    EXPECT_FALSE(find_repeated_member(std::string(60'000, '[')));
}

}  // namespace
}  // namespace panelgate::web::repeated_member_test
