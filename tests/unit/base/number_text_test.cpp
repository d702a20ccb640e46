#include "panelgate/base/text.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace panelgate::number_text_test {
namespace {

TEST(NumberText, IsTheShortestDecimal) {
    EXPECT_EQ(number_text(29.5), "29.5");
    EXPECT_EQ(number_text(-3276.8), "-3276.8");
    EXPECT_EQ(number_text(0.1 + 0.2), "0.30000000000000004");
    EXPECT_EQ(number_text(882.160956249), "882.160956249");
}

TEST(NumberText, WholeNumbersHaveNoPointAndZeroHasNoSign) {
    EXPECT_EQ(number_text(100.0), "100");
    EXPECT_EQ(number_text(100000.0), "100000");
    EXPECT_EQ(number_text(-1e15), "-1000000000000000");
    EXPECT_EQ(number_text(0.0), "0");
    EXPECT_EQ(number_text(-0.0), "0");
}

TEST(NumberText, HasAnExponentOnlyWhereDigitsWouldBeZeros) {
    EXPECT_EQ(number_text(0.0001), "0.0001");
    EXPECT_EQ(number_text(0.00001), "1e-05");
    EXPECT_EQ(number_text(1e16), "1e+16");
    EXPECT_EQ(number_text(1.7976931348623157e308), "1.7976931348623157e+308");
}

TEST(NumberText, AFloatHasItsOwnDigits) {
    EXPECT_EQ(number_text(0.1F), "0.1");
    EXPECT_EQ(number_text(3.4028235e38F), "3.4028235e+38");
    EXPECT_EQ(as_printed(0.1F), 0.1);
    EXPECT_EQ(as_printed(-2147483648.0F), -2147483648.0) << "whole ones stay exact";
    EXPECT_EQ(static_cast<float>(as_printed(1.17549435e-38F)), 1.17549435e-38F);
}

TEST(NumberText, WhatIsNotFiniteHasNoText) {
    EXPECT_EQ(number_text(std::numeric_limits<double>::infinity()), "");
    EXPECT_EQ(number_text(std::numeric_limits<double>::quiet_NaN()), "");
}

}  // namespace
}  // namespace panelgate::number_text_test
