#include "panelgate/base/decimal.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <string>

namespace panelgate::decimal_test {
namespace {

Decimal of(const char* text) { return Decimal::parse(text).value(); }

TEST(Decimal, IsTheSameNumberHoweverItIsWritten) {
    for (const char* text : {"1500", "1.5e3", "1500.000", "0.0015E+6", "+15e2", "001500", "1500."})
        EXPECT_EQ(of(text), Decimal(1500)) << text;
    EXPECT_EQ(of("-0.0"), Decimal());
    EXPECT_EQ(of("0.1"), Decimal(0.1)) << "the shortest digits of the double";
    EXPECT_NE(of("0.1"), Decimal::exactly(0.1));
    EXPECT_EQ(of("18446744073709551616"), Decimal::exactly(0x1p64));
    for (const char* text : {"", "-", ".", "e5", "1e", "1e401", "1e-401", "1e99999999999", "x",
                             "1x", "--1", "1.2.3", "inf", "nan", "0x1"})
        EXPECT_FALSE(Decimal::parse(text)) << text;
}

TEST(Decimal, IsWrittenAsPeopleDoWithAllItsDigits) {
    for (const char* text :
         {"0", "-1", "100", "21.5", "0.0001", "1e-05", "-1.25e-07", "1e+16", "9007199254740.993",
          "18014398509481986", "-18446744073709551616", "3.4028235e+38", "1234567.00000000001"})
        EXPECT_EQ(of(text).text(), text);
    EXPECT_EQ(Decimal(std::numeric_limits<std::int64_t>::min()).text(), "-9223372036854775808");
}

TEST(Decimal, IsAnIntegerWhereItFits) {
    EXPECT_EQ(of("-9223372036854775808").as_int64(), std::numeric_limits<std::int64_t>::min());
    EXPECT_EQ(of("9223372036854775808").as_int64(), std::nullopt);
    EXPECT_EQ(of("1.8446744073709551615e19").as_uint64(),
              std::numeric_limits<std::uint64_t>::max());
    EXPECT_EQ(of("18446744073709551616").as_uint64(), std::nullopt);
    EXPECT_EQ(of("1e300").as_uint64(), std::nullopt);
    EXPECT_EQ(of("-1").as_uint64(), std::nullopt);
    EXPECT_EQ(of("0.5").as_int64(), std::nullopt);
    EXPECT_EQ(Decimal().as_uint64(), 0u);
    EXPECT_EQ(of("9007199254740993").nearest(), 9007199254740992.0);
}

TEST(Decimal, IsOrdered) {
    const char* const rising[] = {
        "-1e300", "-100", "-99.9", "-1", "-0.01",  "0",  "0.0099",           "0.01",
        "0.1",    "1",    "9.99",  "10", "10.001", "11", "9007199254740993", "1e300"};
    for (std::size_t low = 0; low < std::size(rising); ++low) {
        for (std::size_t high = 0; high < std::size(rising); ++high)
            EXPECT_EQ(of(rising[low]) <=> of(rising[high]), low <=> high)
                << rising[low] << ' ' << rising[high];
    }
    EXPECT_LT(of("9007199254740992"), of("9007199254740993"));
    EXPECT_GT(of("-9223372036854775807"), of("-9223372036854775808"));
}

TEST(Decimal, IsMultipliedAndAddedExactly) {
    EXPECT_EQ(Decimal(3) * Decimal(0.1), of("0.3"));
    EXPECT_EQ(of("9007199254740993") * of("-0.001"), of("-9007199254740.993"));
    EXPECT_EQ(Decimal(0) * of("-5"), Decimal());
    EXPECT_EQ(of("1e300") + of("1e-300") + -of("1e300"), of("1e-300"));
    EXPECT_EQ(of("0.1") + of("-0.1"), Decimal());
}

TEST(Decimal, IsDividedIntoTheWholeNumbersAround) {
    const auto is = [](const char* number, const char* by, int below, int nearest, int above) {
        const auto around = of(number).divided_by(of(by));
        EXPECT_EQ(around.below, Decimal(below)) << number << " / " << by;
        EXPECT_EQ(around.nearest, Decimal(nearest)) << number << " / " << by;
        EXPECT_EQ(around.above, Decimal(above)) << number << " / " << by;
    };
    is("21.5", "0.1", 215, 215, 215);
    is("21.54", "0.1", 215, 215, 216);
    is("25", "10", 2, 3, 3);
    is("-25", "10", -3, -3, -2);
    is("-24", "10", -3, -2, -2);
    is("24", "-10", -3, -2, -2);
    is("0.25", "1", 0, 0, 1);
    is("-0.25", "1", -1, 0, 0);
    is("0", "-3", 0, 0, 0);
}

TEST(Decimal, OfVeryManyDigitsKnowsThatThereIsMore) {
    const std::string many = "2." + std::string(200, '0');
    EXPECT_EQ(of((many + "0").c_str()), Decimal(2));
    EXPECT_GT(of((many + "1").c_str()), Decimal(2));
}

}  // namespace
}  // namespace panelgate::decimal_test
