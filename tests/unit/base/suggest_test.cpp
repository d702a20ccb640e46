#include "panelgate/base/text.hpp"

#include <gtest/gtest.h>

namespace panelgate::suggest_test {
namespace {

constexpr std::string_view kKeys[] = {"baud", "parity", "stop_bits", "reply_timeout", "retries"};

TEST(Nearest, FindsWhatWasProbablyMeant) {
    EXPECT_EQ(nearest("bauds", kKeys), "baud") << "one letter more";
    EXPECT_EQ(nearest("parit", kKeys), "parity") << "one letter less";
    EXPECT_EQ(nearest("stop-bits", kKeys), "stop_bits") << "another letter";
    EXPECT_EQ(nearest("reply_timoeut", kKeys), "reply_timeout") << "two swapped";
    EXPECT_EQ(nearest("reply_time_outs", kKeys), "reply_timeout") << "two edits";
}

TEST(Nearest, ReturnsNothingIfNoneIsNear) {
    EXPECT_EQ(nearest("address", kKeys), "");
    EXPECT_EQ(nearest("reply_tmt", kKeys), "") << "four edits";
    EXPECT_EQ(nearest("", kKeys), "");
    EXPECT_EQ(nearest("baud", {}), "");
}

TEST(Nearest, WantsTwoThirdsOfAShortWordRight) {
    constexpr std::string_view kWords[] = {"id", "unit"};
    EXPECT_EQ(nearest("ip", kWords), "") << "half of it is wrong";
    EXPECT_EQ(nearest("unti", kWords), "unit");
}

TEST(Nearest, TakesTheNearerOfTwo) {
    constexpr std::string_view kWords[] = {"retries", "retry"};
    EXPECT_EQ(nearest("retrie", kWords), "retries");
    EXPECT_EQ(nearest("retr", kWords), "retry");
}

TEST(Nearest, FindsTheWordItself) { EXPECT_EQ(nearest("baud", kKeys), "baud"); }

TEST(Suggest, KnowsOtherSpellings) {
    constexpr std::array<std::string_view, 3> kWords{"panasonic-gt", "data_bits", "info"};
    EXPECT_EQ(nearest("Panasonic GT", kWords), "panasonic-gt");
    EXPECT_EQ(nearest("dataBits", kWords), "data_bits");
    EXPECT_EQ(nearest("INFO", kWords), "info");
}

TEST(Suggest, KnowsSynonymsOfOtherIndustries) {
    constexpr std::array<std::string_view, 5> kWords{"baud", "i16", "f32", "none", "warn"};
    EXPECT_EQ(nearest("baudrate", kWords), "baud");
    EXPECT_EQ(nearest("int16", kWords), "i16");
    EXPECT_EQ(nearest("FLOAT", kWords), "f32");
    EXPECT_EQ(nearest("N", kWords), "none");
    EXPECT_EQ(nearest("warning", kWords), "warn");
    EXPECT_EQ(nearest("double", kWords), "") << "nobody here has f64";
}

}  // namespace
}  // namespace panelgate::suggest_test
