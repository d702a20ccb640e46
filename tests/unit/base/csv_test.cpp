#include "panelgate/base/csv.hpp"

#include <gmock/gmock.h>

namespace panelgate::csv_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(Csv, QuotesSeparatorsLineEndsAndAByteOrderMark) {
    const Csv csv =
        parse_csv("\xEF\xBB\xBFname;at\r\n\"a;\"\"b\"\"\nc\";UW1\r\n\r\nd;\n;\rlast;UW2");
    EXPECT_EQ(csv.fault, "");
    ASSERT_EQ(csv.rows.size(), 5U);
    EXPECT_THAT(csv.rows[0].cells, ElementsAre("name", "at"));
    EXPECT_THAT(csv.rows[1].cells, ElementsAre("a;\"b\"\nc", "UW1"));
    EXPECT_EQ(csv.rows[1].line, 2);
    EXPECT_THAT(csv.rows[2].cells, ElementsAre("d", ""));
    EXPECT_EQ(csv.rows[2].line, 5) << "a quoted line end and an empty line count";
    EXPECT_THAT(csv.rows[4].cells, ElementsAre("last", "UW2"));
    EXPECT_EQ(csv.rows[4].line, 7);
}

TEST(Csv, TheFirstLineDecidesTheSeparator) {
    EXPECT_THAT(parse_csv("a,b\n1;2,3").rows[1].cells, ElementsAre("1;2", "3"));
    EXPECT_THAT(parse_csv("a\tb\n1,5\t2").rows[1].cells, ElementsAre("1,5", "2"));
}

TEST(Csv, AFaultEndsIt) {
    const Csv open = parse_csv("a,b\n\"1,2\n3,4\n");
    EXPECT_EQ(open.fault, "a quote is not closed");
    EXPECT_EQ(open.fault_line, 2);
    const Csv behind = parse_csv("a,b\n\"1\"x,2\n3,4\n");
    EXPECT_EQ(behind.fault, "behind a closing quote comes a separator or the end of the line");
    EXPECT_EQ(behind.rows.size(), 2U);
    EXPECT_THAT(parse_csv("").rows, IsEmpty());
    EXPECT_EQ(parse_csv("\"").fault, "a quote is not closed");
    EXPECT_EQ(parse_csv("\"\"\"").fault, "a quote is not closed");
}

}  // namespace
}  // namespace panelgate::csv_test
