#include "body.hpp"

#include <gmock/gmock.h>

#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>
#include <cmath>
#include <limits>
#include <string>

namespace panelgate::web::body_test {
namespace {

Parsed<std::vector<std::uint16_t>> cells_of(std::string_view body, modbus::Table table) {
    const auto object = parse_object(body, {"values"});
    if (!object) return object.error();
    return values_member(*object, table);
}
Parsed<points::Value> value_of(std::string_view body) {
    const auto object = parse_object(body, {"value"});
    if (!object) return object.error();
    return value_member(*object);
}

using modbus::Table;
using ::testing::ElementsAre;
using ::testing::StartsWith;
using Cells = std::vector<std::uint16_t>;

std::string registers_error(const std::string& body) {
    const auto cells = cells_of(body, Table::holding_registers);
    if (cells) return "";
    EXPECT_EQ(cells.error().status, 400u);
    return cells.error().detail;
}

TEST(Body, TakesRegistersUnsignedOrAsTwosComplement) {
    EXPECT_THAT(*cells_of(R"({"values":[0, 65535, -1, -32768, 10.0]})", Table::holding_registers),
                ElementsAre(0, 0xFFFF, 0xFFFF, 0x8000, 10));
    for (const char* value : {"65536", "-32769", "1.5", "\"1\"", "true", "null", "[1]", "1e16"}) {
        EXPECT_THAT(registers_error(std::string("{\"values\":[1, ") + value + "]}"),
                    StartsWith("a register is a whole number from 0 to 65535, or from -32768, not"))
            << value;
    }
}

TEST(Body, TakesBitsAsBooleansOrNumbers) {
    EXPECT_THAT(*cells_of(R"({"values":[true, false, 1, 0, 1.0]})", Table::coils),
                ElementsAre(1, 0, 1, 0, 1));
    const auto two = cells_of(R"({"values":[2]})", Table::coils);
    ASSERT_FALSE(two);
    EXPECT_EQ(two.error().detail, "a bit is true, false, 1 or 0, not 2");
}

TEST(Body, WantsValues) {
    for (const char* body : {"{}", R"({"values":[]})", R"({"values":1})"}) {
        EXPECT_EQ(registers_error(body),
                  R"(the body must be {"values": [...]} with at least one value)")
            << body;
    }
}

TEST(Body, SaysWhatAHandTypesThatIsNoJson) {
    const auto told = [](std::string_view body) {
        const std::string text = value_of(body).error().detail;
        return text.substr(std::string_view("the body is not JSON: line 1, ").size());
    };
    EXPECT_EQ(told(""), "column 1: it is empty; send an object, such as {\"value\": 1}");
    EXPECT_EQ(told("\xEF\xBB\xBF{\"value\": 1}"),
              "column 1: a byte order mark (U+FEFF) precedes the value; send the body without");
    EXPECT_EQ(told("{\"value\": \"\xFF\"}"), "column 12: this is not UTF-8");
    EXPECT_EQ(told("{\"value\": +21}"), "column 11: a number of JSON has no '+'; remove it");
    EXPECT_EQ(told("{\"value\": .5}"),
              "column 11: a number of JSON has a digit before its '.'; write 0.");
    EXPECT_EQ(told("{\"value\": 021}"),
              "column 12: a number of JSON has no leading zeros; write it without");
    EXPECT_EQ(told("{\"value\": 1} // one"), "column 14: JSON has no comments; remove it");
    EXPECT_EQ(told("{\"value\": 1,}"), "column 13: a ',' too many before this");
    EXPECT_EQ(told("{\"value\": True}"), "column 11: it is written true");
    EXPECT_EQ(told("{\"value\": 1"),
              "column 12: it ends before it is complete; a bracket or a quote is not closed");
}

TEST(Body, PointsAtWhatIsNoJson) {
    EXPECT_THAT(registers_error("{\"values\":\n [1,, 2]}"),
                StartsWith("the body is not JSON: line 2, column 5: "));
    EXPECT_THAT(registers_error("{\"values\":[1]"),
                StartsWith("the body is not JSON: line 1, column 14: "));
    EXPECT_THAT(registers_error(""), StartsWith("the body is not JSON: line 1, column 1: "));
    EXPECT_EQ(registers_error("{} x"),
              "the body is not JSON: line 1, column 4: something follows the value");
    EXPECT_EQ(registers_error("[1]"), "the body must be a JSON object");
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
    EXPECT_THAT(registers_error(R"({"values":[{"a":1,"a":2}]})"),
                StartsWith("the member 'a' comes a second time: line 1, "));
}

TEST(Body, TakesAPointsValueAsItIs) {
    using points::Value;
    EXPECT_EQ(*value_of(R"({"value":true})"), Value(true));
    EXPECT_EQ(*value_of(R"({"value":-5})"), Value(std::int64_t{-5}));
    EXPECT_EQ(*value_of(R"({"value":18446744073709551615})"), Value(18446744073709551615u));
    EXPECT_EQ(*value_of(R"({"value":1.5})"), Value(1.5));
    EXPECT_EQ(*value_of(R"({"value":"Ok"})"), Value(std::string("Ok")));
    EXPECT_EQ(value_of("{}").error().detail, "the body needs \"value\"");
    for (const char* body : {R"({"value":null})", R"({"value":[1]})", R"({"value":{}})"}) {
        EXPECT_EQ(value_of(body).error().detail, "value must be a number, true, false or a text");
    }
}

TEST(Body, TakesANumberAsItIsWritten) {
    using points::Value;
    const std::int64_t beyond_doubles = 9007199254740993;
    EXPECT_EQ(*value_of(R"({"value":9007199254740993})"), Value(beyond_doubles));
    EXPECT_EQ(*value_of(R"({"value":-9007199254740993.0})"), Value(-beyond_doubles));
    EXPECT_EQ(*value_of(R"({"value":9007199254740.9930e+03})"), Value(beyond_doubles));
    EXPECT_EQ(*value_of(R"({"value":1e19})"), Value(10'000'000'000'000'000'000u));
    EXPECT_EQ(*value_of(R"({"value":-9223372036854775808})"),
              Value(std::numeric_limits<std::int64_t>::min()));
    for (const char* digits : {"18446744073709551616", "9007199254740.993", "-1234567.00000000001"})
        EXPECT_EQ(*value_of(std::string("{\"value\":") + digits + "}"),
                  Value(*Decimal::parse(digits)));
    EXPECT_EQ(*value_of(R"({"value":1e300})"), Value(1e300));
    EXPECT_EQ(*value_of(R"({"value":7.0385307e-26})"), Value(7.0385307e-26)) << "nearest";
    EXPECT_TRUE(std::signbit(std::get<double>(*value_of(R"({"value":-0.0})"))));
}

TEST(Body, RefusesANumberThatNoneCouldBe) {
    for (const char* number : {"1e400", "-1e400", "1e-400"}) {
        const auto value = value_of(std::string("{\"value\": ") + number + "}");
        ASSERT_FALSE(value) << number;
        EXPECT_EQ(value.error().status, 400u);
        EXPECT_EQ(value.error().detail,
                  std::string("a number that cannot be: line 1, column 11: ") + number +
                      " is beyond what a 64-bit number holds");
    }
    EXPECT_EQ(value_of("{\"value\": NaN}").error().detail,
              "the body is not JSON: line 1, column 11: NaN is no number of JSON");
    for (const char* number : {"NaN", "Infinity", "-Infinity", "1e99999999999999999999"})
        EXPECT_EQ(value_of(std::string("{\"value\": ") + number + "}").error().status, 400u);
}

TEST(Body, TakesNoNumberOfManyDigitsForAText) {
    EXPECT_EQ(registers_error(R"({"values":[1.00000000000000000001]})"),
              "a register is a whole number from 0 to 65535, or from -32768, not "
              "1.00000000000000000001");
    const auto object = parse_object(R"({"t":1.00000000000000000001})");
    EXPECT_EQ(string_member(*object, "t").error().detail, "t must be a string");
    EXPECT_EQ(value_of("{\"value\":\"\xFF"
                       "1\"}")
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
}  // namespace panelgate::web::body_test
