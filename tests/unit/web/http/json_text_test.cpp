#include "panelgate/web/http/json_text.hpp"

#include <gtest/gtest.h>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <limits>
#include <string>

namespace panelgate::web::json_text_test {
namespace {

namespace json = boost::json;

TEST(JsonText, HasNumbersAsPeopleWriteThem) {
    EXPECT_EQ(json_text(json::array{29.5, 0.0, 100.0, -3276.8, 882.160956249, 1e-7}),
              "[29.5,0,100,-3276.8,882.160956249,1e-07]");
    EXPECT_EQ(json_text(json::array{-5, 18446744073709551615U, true, nullptr}),
              "[-5,18446744073709551615,true,null]");
}

TEST(JsonText, WhatIsNotFiniteIsNull) {
    EXPECT_EQ(json_text(std::numeric_limits<double>::quiet_NaN()), "null");
    EXPECT_EQ(json_text(std::numeric_limits<double>::infinity()), "null");
}

TEST(JsonText, KeepsMembersInTheirOrderAndEscapesTexts) {
    const json::object object{{"b", json::array{}}, {"a", json::object{}}, {"\"", "x\n\\\x1f"}};
    EXPECT_EQ(json_text(object), R"({"b":[],"a":{},"\"":"x\n\\\u001f"})");
    EXPECT_EQ(json::parse(json_text(object)), json::value(object));
}

TEST(JsonText, AnExcerptIsShortAndCutsNoCharacterInTwo) {
    EXPECT_EQ(excerpt("7"), "7");
    const std::string long_one(79, 'x');
    EXPECT_EQ(excerpt(long_one + "\u00b0\u00b0"), long_one + "...");
}

}  // namespace
}  // namespace panelgate::web::json_text_test
