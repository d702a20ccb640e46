// Tables and times as a person reads them.
#include "table.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace panelgate::commands::table_test {
namespace {

TEST(TextTable, AlignsColumnsAndEndsWithoutBlanks) {
    TextTable table({"STATION", ">LOAD", "STATE"});
    table.add({"press", "4.5 %", {"online", Colour::good}});
    table.add({"\xC3\xB6ven", "12.5 %"});
    EXPECT_EQ(table.text(false),
              "STATION    LOAD  STATE\n"
              "press     4.5 %  online\n"
              "\xC3\xB6ven     12.5 %\n");
    EXPECT_NE(table.text(true).find("\x1b[32monline\x1b[0m\n"), std::string::npos);
}

TEST(TextTable, WithoutHeadingsHasRowsOnly) {
    TextTable table({"", ""});
    EXPECT_TRUE(table.empty());
    table.add({"UW0", "10"});
    table.add({"holding-registers/1", "20"});
    EXPECT_EQ(table.text(false), "UW0                  10\nholding-registers/1  20\n");
}

TEST(Colours, AreForTerminalsThatWantThem) {
    EXPECT_TRUE(wants_colours(true, nullptr, "xterm"));
    EXPECT_TRUE(wants_colours(true, "", nullptr));
    EXPECT_FALSE(wants_colours(true, "1", "xterm"));
    EXPECT_FALSE(wants_colours(true, nullptr, "dumb"));
    EXPECT_FALSE(wants_colours(false, nullptr, "xterm"));
}

TEST(Printable, LeavesATerminalAlone) {
    EXPECT_EQ(printable("a\x1b[2Jb\n"), "a?[2Jb?");
    EXPECT_EQ(width_of("\xC2\xB0"
                       "C"),
              2U);
}

TEST(CutToScreen, KeepsTheLastLineAndSaysWhatIsLeftOut) {
    EXPECT_EQ(cut_to_screen("one\n\nthree\nend", 4, 3), "one\n\nthr\nend");
    EXPECT_EQ(cut_to_screen("1\n2\n3\n4\n5\nend", 4, 20), "1\n2\n(3 more lines)\nend");
    EXPECT_EQ(cut_to_screen("\x1b[1mload\x1b[0m", 24, 2), "\x1b[1mlo\x1b[0m");
    EXPECT_EQ(cut_to_screen("\xC3\xB6ven", 24, 2), "\xC3\xB6v");
    EXPECT_EQ(cut_to_screen("", 24, 80), "");
}

TEST(Times, HaveTheUnitThatAPersonWouldUse) {
    EXPECT_EQ(span_text(0.44), "0.4 s");
    EXPECT_EQ(span_text(35.9), "35 s");
    EXPECT_EQ(span_text(12 * 60 + 59), "12 min");
    EXPECT_EQ(span_text(3.5 * 3600), "3 h");
    EXPECT_EQ(span_text(5.2 * 86400), "5 d");
    EXPECT_EQ(latency_text(0.0074), "7.4 ms");
    EXPECT_EQ(latency_text(1.25), "1.2 s");
    EXPECT_EQ(latency_text(std::numeric_limits<double>::quiet_NaN()), "-");
}

}  // namespace
}  // namespace panelgate::commands::table_test
