#include "panelgate/web/api/values.hpp"

#include <gmock/gmock.h>

#include <boost/json/parse.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "panelgate/base/decimal.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::web::values_test {
namespace {

using modbus::Table;
using points::Value;
using ::testing::ElementsAre;
using ::testing::StartsWith;

Parsed<std::vector<std::uint16_t>> cells_in(std::string_view body, Table table) {
    const auto object = parse_object(body, {"values"});
    if (!object) return object.error();
    return web::cells_of(*object, table);
}
Parsed<Value> value_of(std::string_view body) {
    const auto object = parse_object(body, {"value"});
    if (!object) return object.error();
    return value_member(*object);
}
Parsed<Value> number_of(const std::string& text) { return value_of("{\"value\": " + text + "}"); }

std::string registers_error(const std::string& body) {
    const auto cells = cells_in(body, Table::holding_registers);
    if (cells) return "";
    EXPECT_EQ(cells.error().status, 400u);
    return cells.error().detail;
}

TEST(Body, TakesRegistersUnsignedOrAsTwosComplementAndBitsAsBooleansOrNumbers) {
    EXPECT_THAT(*cells_in(R"({"values":[0, 65535, -1, -32768, 10.0]})", Table::holding_registers),
                ElementsAre(0, 0xFFFF, 0xFFFF, 0x8000, 10));
    for (const char* value : {"65536", "-32769", "1.5", "\"1\"", "true", "null", "[1]", "1e16"}) {
        EXPECT_THAT(registers_error(std::string("{\"values\":[1, ") + value + "]}"),
                    StartsWith("a register is a whole number from 0 to 65535, or from -32768, not"))
            << value;
    }
    EXPECT_THAT(*cells_in(R"({"values":[true, false, 1, 0, 1.0]})", Table::coils),
                ElementsAre(1, 0, 1, 0, 1));
    EXPECT_EQ(cells_in(R"({"values":[2]})", Table::coils).error().detail,
              "a bit is true, false, 1 or 0, not 2");
}

TEST(Body, WantsValues) {
    for (const char* body : {"{}", R"({"values":[]})", R"({"values":1})"}) {
        EXPECT_EQ(registers_error(body),
                  R"(the body must be {"values": [...]} with at least one value)")
            << body;
    }
    EXPECT_EQ(registers_error("[1]"), "the body must be a JSON object");
}

TEST(Body, SaysWhatAHandTypesThatIsNoJson) {
    struct Row {
        const char* body;
        const char* fault;
    };
    constexpr Row kRows[] = {
        {"", "1: it is empty; send an object, such as {\"value\": 1}"},
        {"{\"value\": \"\xFF\"}", "12: it is not UTF-8"},
        {"{\"value\": 1,}",
         "13: a value, a quote, a ':' or a ',' is missing here, or something else is too many"},
        {"{\"value\": 1", "12: it ends before it is complete; a bracket or a quote is not closed"},
        {"{} x", "4: something follows the value"},
    };
    for (const Row& row : kRows) {
        EXPECT_EQ(value_of(row.body).error().detail,
                  "the body is not JSON: line 1, column " + std::string(row.fault));
    }
    EXPECT_THAT(registers_error("{\"values\":\n [1,, 2]}"),
                StartsWith("the body is not JSON: line 2, column 5: "));
}

TEST(Body, WithAMemberThatNobodyKnowsIsRefused) {
    EXPECT_EQ(registers_error(R"({"values":[1],"valeus":[3]})"),
              "unknown member 'valeus'; did you mean 'values'?");
    EXPECT_EQ(registers_error(R"({"Values":[1]})"),
              "unknown member 'Values'; did you mean 'values'?");
    EXPECT_EQ(value_of(R"({"value":1,"round":true})").error().detail,
              "unknown member 'round'; known here: value");
}

TEST(Body, WithAMemberTwiceIsRefusedAtAnyDepth) {
    EXPECT_EQ(registers_error("{\"values\":[1],\n\"values\":[2]}"),
              "the member 'values' comes a second time: line 2, column 1");
    for (const char* twice : {R"({"values":[{"a":1,"a":2}]})", R"({"a":1,"\u0061":2})",
                              R"([{"x":{"c":1,"b":[{"c":1,"d":2,"c":3}]}}])"})
        EXPECT_THAT(registers_error(twice), testing::HasSubstr("comes a second time: line 1, "))
            << twice;
    EXPECT_TRUE(parse_json(R"({"a":{"a":[{"a":1},{"a":2}]},"A":1})"));
    EXPECT_TRUE(parse_json(R"(["a","a"])"));
    EXPECT_FALSE(parse_json(std::string(60'000, '[')));
}

TEST(Body, TakesAPointsValueAsItIs) {
    EXPECT_EQ(*number_of("true"), Value(true));
    EXPECT_EQ(*number_of("-5"), Value(std::int64_t{-5}));
    EXPECT_EQ(*number_of("18446744073709551615"), Value(18446744073709551615u));
    EXPECT_EQ(*number_of("1.5"), Value(1.5));
    EXPECT_EQ(*number_of("\"Ok\""), Value(std::string("Ok")));
    EXPECT_EQ(value_of("{}").error().detail, "the body needs \"value\"");
    for (const char* text : {"null", "[1]", "{}"}) {
        EXPECT_EQ(number_of(text).error().detail, "value must be a number, true, false or a text");
    }
}

TEST(Body, TakesANumberAsItIsWritten) {
    const std::int64_t beyond_doubles = 9007199254740993;
    EXPECT_EQ(*number_of("9007199254740993"), Value(beyond_doubles));
    EXPECT_EQ(*number_of("-9007199254740993.0"), Value(-beyond_doubles));
    EXPECT_EQ(*number_of("9007199254740.9930e+03"), Value(beyond_doubles));
    EXPECT_EQ(*number_of("1e19"), Value(10'000'000'000'000'000'000u));
    EXPECT_EQ(*number_of("-9223372036854775808"), Value(std::numeric_limits<std::int64_t>::min()));
    for (const char* digits : {"18446744073709551616", "9007199254740.993", "-1234567.00000000001"})
        EXPECT_EQ(*number_of(digits), Value(*Decimal::parse(digits)));
    EXPECT_EQ(*number_of("1e300"), Value(1e300));
    EXPECT_EQ(*number_of("7.0385307e-26"), Value(7.0385307e-26)) << "nearest";
    EXPECT_TRUE(std::signbit(std::get<double>(*number_of("-0.0"))));
}

TEST(Body, RefusesANumberThatNoneCouldBe) {
    for (const char* number : {"1e400", "-1e400", "1e-400"}) {
        const auto value = number_of(number);
        ASSERT_FALSE(value) << number;
        EXPECT_EQ(value.error().status, 400u);
        EXPECT_EQ(value.error().detail,
                  std::string("a number that cannot be: line 1, column 11: ") + number +
                      " is beyond what a 64-bit number holds");
    }
    for (const char* number : {"NaN", "Infinity", "-Infinity", "1e99999999999999999999"})
        EXPECT_EQ(number_of(number).error().status, 400u) << number;
}

TEST(Body, TakesNoNumberOfManyDigitsForAText) {
    EXPECT_EQ(registers_error(R"({"values":[1.00000000000000000001]})"),
              "a register is a whole number from 0 to 65535, or from -32768, not "
              "1.00000000000000000001");
    const auto object = parse_object(R"({"t":1.00000000000000000001})");
    EXPECT_EQ(string_member(*object, "t").error().detail, "t must be a string");
    EXPECT_EQ(number_of("\"\xFF"
                        "1\"")
                  .error()
                  .status,
              400u)
        << "no UTF-8";
}

TEST(Body, GivesMembersOfTheirKind) {
    const auto object = boost::json::parse(R"({"n":7.0,"t":"x"})").as_object();
    EXPECT_EQ(*number_member(object, "n", 0, 7), 7);
    EXPECT_EQ(number_member(object, "n", 0, 6).error().detail,
              "n must be a whole number from 0 to 6, not 7");
    EXPECT_EQ(number_member(object, "m", 0, 6).error().detail, "the body lacks m");
    EXPECT_EQ(*string_member(object, "t"), "x");
    EXPECT_EQ(string_member(object, "n").error().detail, "n must be a string");
    EXPECT_EQ(string_member(object, "m").error().detail, "the body lacks m");
}

}  // namespace
}  // namespace panelgate::web::values_test
