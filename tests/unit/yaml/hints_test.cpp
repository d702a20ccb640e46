#include "hints.hpp"

#include <gtest/gtest.h>

#include <string>

namespace panelgate::yaml::hints_test {
namespace {

TEST(Hints, WriteADurationAsItIsRead) {
    EXPECT_EQ(duration_hint("0.5s"), "; write 500ms");
    EXPECT_EQ(duration_hint("1,5 s"), "; write 1500ms");
    EXPECT_EQ(duration_hint("500 ms"), "; write 500ms");
    EXPECT_EQ(duration_hint("500MS"), "; write 500ms");
    EXPECT_EQ(duration_hint("1m"), "; write 1min");
    EXPECT_EQ(duration_hint("1h"), "; write 60min");
    EXPECT_EQ(duration_hint("1m30s"), "; write 90s");
    EXPECT_EQ(duration_hint("20 \xC2\xB5s"), "; write 20us");
    EXPECT_EQ(duration_hint("500"), " (add a unit: us, ms, s, min)");
    for (const char* text : {"", "soon", "5 parsecs", "-5ms", "1e9s", "99999999999999999d", "5ms5"})
        EXPECT_EQ(duration_hint(text), "") << text;
}

TEST(Hints, WriteANumberAsItIsRead) {
    EXPECT_EQ(number_hint("0,1", false), "; write 0.1");
    EXPECT_EQ(number_hint("+5", false), "; write 5");
    EXPECT_EQ(number_hint("400 C", false), "; write 400");
    EXPECT_EQ(number_hint("10%", false), "; write 0.1");
    EXPECT_EQ(number_hint("0x1F", true), "; write 31");
    EXPECT_EQ(number_hint("38.400", true), "; write 38400");
    EXPECT_EQ(number_hint("1.0", true), "; write 1");
    EXPECT_EQ(number_hint("9600 baud", true), "; write 9600");
    EXPECT_EQ(number_hint("9.6e3", true), "; write 9600");
    EXPECT_EQ(number_hint("9,600", true), "; write 9600");
    EXPECT_EQ(number_hint("9.6k", true), "; write 9600");
    EXPECT_EQ(number_hint("38k4", true), "; write 38400");
    EXPECT_EQ(number_hint("\u22125", true), "; write -5");
    for (const char* tenth : {"1/10", "/10", "x0.1", "*0.1", "10^-1"})
        EXPECT_EQ(number_hint(tenth, false), "; write 0.1") << tenth;
    for (const char* text : {"", "ten", "-", ".", "/", "1/0", "x", "^2"})
        EXPECT_EQ(number_hint(text, false), "") << text;
    for (const char* text : {"1.5", "1.5.600", "k", "ten", "1/0"})
        EXPECT_EQ(number_hint(text, true), "") << text;
}

TEST(Hints, WriteAVariableAsItIsRead) {
    EXPECT_EQ(variable_hint("$BAUD"), "; write ${BAUD} for a variable of the environment");
    EXPECT_EQ(variable_hint("%BAUD%"), "; write ${BAUD} for a variable of the environment");
    EXPECT_EQ(variable_hint("5%"), "");
}

TEST(Hints, FindTheBlankThatIsMissing) {
    EXPECT_EQ(blank_hint("baud:9600"), "; a blank is missing after 'baud:'");
    EXPECT_EQ(blank_hint("baud=9600"), "; write baud: 9600");
    EXPECT_EQ(blank_hint("tcp://x:1"), "");
    EXPECT_EQ(blank_hint("two words:1"), "");
}

}  // namespace
}  // namespace panelgate::yaml::hints_test
