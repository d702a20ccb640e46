#include "registers.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <optional>
#include <string>

namespace panelgate::points::scaling_test {
namespace {

TEST(Scaling, ValuesAreTheDoublesOfTheirDecimals) {
    EXPECT_EQ(Scaling(0.1, 0).value_of(3), 0.3) << "not 0.30000000000000004";
    EXPECT_EQ(Scaling(0.3, 0).value_of(3), 0.9);
    EXPECT_EQ(Scaling(0.1, 0.2).value_of(1), 0.3);
    EXPECT_EQ(Scaling(1e-9, 1e3).value_of(1), 1000.000000001);
    EXPECT_EQ(Scaling(-2.5, 10).value_of(4), 0);
    for (int raw = -32768; raw <= 32767; raw += 3)
        ASSERT_EQ(Scaling(0.007, 0).value_of(raw), std::stod(std::to_string(raw * 7) + "e-3"));
}

TEST(Scaling, ADecimalHasARawNumberOrNone) {
    const Scaling tenths(0.1, 0);
    EXPECT_EQ(tenths.exact_raw_of(21.5), Decimal(215));
    EXPECT_EQ(tenths.exact_raw_of(21.55), std::nullopt);
    EXPECT_EQ(tenths.exact_raw_of(-0.3), Decimal(-3));
    EXPECT_EQ(tenths.exact_raw_of(-0.0), Decimal(0));
    EXPECT_EQ(Scaling(10, 0).exact_raw_of(25.0), std::nullopt);
    EXPECT_EQ(Scaling(10, 5).exact_raw_of(25.0), Decimal(2));
    EXPECT_EQ(Scaling(0.1, -5).exact_raw_of(21.5), Decimal(265));
    EXPECT_EQ(Scaling(-0.25, 0).exact_raw_of(0.75), Decimal(-3));
    EXPECT_EQ(Scaling(1e6, 0).exact_raw_of(3e6), Decimal(3));
    EXPECT_EQ(Scaling(1, 0.5).exact_raw_of(2.0), std::nullopt);
}

TEST(Scaling, WhatItShowsHasARawNumber) {
    for (const double scale : {1.0 / 3, 0.123456789, 1e-12, 7.7e8, -0.1}) {
        for (const double offset : {0.0, 1.0 / 7, -1e6}) {
            const Scaling scaling(scale, offset);
            for (std::int64_t raw = -5000; raw <= 5000; raw += 37) {
                const double shown = scaling.value_of(static_cast<double>(raw));
                if (scaling.value_of(static_cast<double>(raw + 1)) == shown ||
                    scaling.value_of(static_cast<double>(raw - 1)) == shown)
                    continue;  // more digits than a double has
                ASSERT_EQ(scaling.exact_raw_of(shown), Decimal(raw)) << scale << ' ' << offset;
            }
        }
    }
}

TEST(Scaling, WholeValuesAreExactBeyondWhatADoubleHolds) {
    const Scaling tens(10, 0);
    EXPECT_EQ(tens.exact_raw_of(std::int64_t{1234567890123456780}),
              Decimal(std::int64_t{123456789012345678}));
    EXPECT_EQ(tens.exact_raw_of(std::int64_t{1234567890123456789}), std::nullopt);
    EXPECT_EQ(tens.exact_raw_of(std::numeric_limits<std::int64_t>::min()), std::nullopt);
    EXPECT_EQ(tens.exact_raw_of(std::int64_t{70}), Decimal(7));
}

TEST(Scaling, TakesTheDigitsWithWhichSomeWriteEveryDouble) {
    const Scaling tenths(0.1, 0);
    EXPECT_EQ(tenths.exact_raw_of(*Decimal::parse("0.29999999999999999")), Decimal(3));
    EXPECT_EQ(tenths.exact_raw_of(*Decimal::parse("0.299999999999999990001")), std::nullopt);
}

TEST(Scaling, DigitsThatLieTooFarApartAreRoundedAsDoublesAre) {
    const Scaling wide(1e15, 1e-15);
    EXPECT_EQ(wide.value_of(3), 3e15);
    EXPECT_EQ(wide.exact_raw_of(3e15), Decimal(3));
    EXPECT_EQ(wide.exact_raw_of(3.5e15), std::nullopt);
    EXPECT_EQ(Scaling(0.1, 0).exact_raw_of(1e300), Decimal(1e301));
}

}  // namespace
}  // namespace panelgate::points::scaling_test
