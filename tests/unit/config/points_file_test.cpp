#include <gmock/gmock.h>

#include <string>

#include "memory_files.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::config::points_file_test {
namespace {

const std::string kText =
    "lines:\n  - name: a\n    device: sim\n    serial: {baud: 38400, parity: none}\n"
    "    stations:\n"
    "      - {id: 31, name: press, profile: autonics-gplp-s, points_file: /p/press.csv,\n"
    "         points: [{name: first, at: UW1}]}\n"
    "modbus_tcp: [{listen: 127.0.0.1:0}]\n";

MemoryFiles with(const std::string& table) { return MemoryFiles({{"/p/press.csv", table}}); }

std::vector<points::Point> points_of(const std::string& table) {
    return load_valid(kText, with(table)).lines[0].stations[0].points;
}

/// What is wrong with the table: "2:3 ..." a line, without what comes of an absent station.
std::string faults_of(const std::string& table) {
    yaml::Problems problems("f.yaml");
    EXPECT_FALSE(load(kText, with(table), problems)) << table;
    std::string text;
    for (const yaml::Problem& one : problems.list())
        text += one.file + ':' + std::to_string(one.mark.line) + ':' +
                std::to_string(one.mark.column) + ' ' + one.message + '\n';
    return text;
}

TEST(PointsFile, ARowIsAPointAndAColumnAKey) {
    const auto points = points_of(
        "name;at;type;scale;unit;writable;max;labels;no_value;report;overview;value\n"
        "level;UW20;i16;0.1;celsius;TRUE;60;;[-32768];{deadband: 0.5};FALSE;21.5\n"
        "mode;UW11;;;;;;\"{0: off, 1: \"\"it's, on\"\"}\";;;TRUE;1\n"
        ";;;;;;;;;;;\n"
        "valve;UB180;;;;;;;;;;\n");
    ASSERT_EQ(points.size(), 4U);
    EXPECT_EQ(points[0].name, "first");
    EXPECT_EQ(points[1].scale, 0.1);
    EXPECT_EQ(points[1].unit, "celsius");
    EXPECT_TRUE(points[1].writable);
    EXPECT_EQ(points[1].no_value, std::vector<std::int64_t>{-32768});
    EXPECT_EQ(points[1].report.deadband, 0.5);
    EXPECT_EQ(points[2].labels.at(1), "it's, on");
    EXPECT_TRUE(points[2].overview);
    EXPECT_EQ(points[3].type, points::Type::boolean);
}

TEST(PointsFile, RowsOfOtherStationsArePassedOver) {
    const auto points = points_of("station,name,at\npress,a,UW5\noven,b,UW6\npress,c,UW7\n");
    ASSERT_EQ(points.size(), 3U);
    EXPECT_EQ(points[2].name, "c");
}

TEST(PointsFile, FaultsAreToldWithFileRowAndColumn) {
    const std::pair<const char*, const char*> cases[] = {
        {"", "/p/press.csv:1:1 the first row names the columns, such as name,at,type,unit\n"},
        {"name,adress\na,UW1\n", "/p/press.csv:1:2 there is no column 'adress'"},
        {"at\nUW5\n",
         "/p/press.csv:1:1 the column 'name' is missing; the first row names the columns, "
         "separated by ',' or ';'\n"},
        {"name,at,at\n", "/p/press.csv:1:3 there are two columns 'at'\n"},
        {"name;at;scale\na;UW5;0,1\n",
         "/p/press.csv:2:3 scale has a decimal comma: write 0.1, not 0,1\n"},
        {"name,at\na,UW5,7\n",
         "/p/press.csv:2:3 this row has 3 cells, the first one 2; a cell with the separator stands "
         "in quotes\n"},
        {"name,at\n\"a,UW5\n", "/p/press.csv:2:1 a quote is not closed\n"},
        {"name,at\nfirst,UW5\n", "/p/press.csv:2:1 there are two points 'first' of this station"},
        {"name,at,type\na,UW5,float\n", "/p/press.csv:2:3 type must be bool,"},
        {"name,at,labels\na,UW5,{0: off\n", "/p/press.csv:2:3 "},
        {"name,at,every\na,UW5,5\n", "/p/press.csv:2:3 every must be"},
        {"name,at\na,XX5\n", "/p/press.csv:2:2 "},
        {"name,at\n,UW5\n", "/p/press.csv:2:1 a point needs 'name'"},
    };
    for (const auto& [table, expected] : cases)
        EXPECT_THAT(faults_of(table), ::testing::HasSubstr(expected)) << table;
}

TEST(PointsFile, AFileThatIsNotThereIsToldAtItsKey) {
    yaml::Problems problems("f.yaml");
    EXPECT_FALSE(load(kText, MemoryFiles({}), problems));
    EXPECT_EQ(problems.text(), "f.yaml:6:70: cannot read the points of 'press' in /p/press.csv\n");
}

}  // namespace
}  // namespace panelgate::config::points_file_test
