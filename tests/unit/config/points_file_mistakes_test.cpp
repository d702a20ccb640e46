#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "memory_files.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::config::points_file_mistakes_test {
namespace {

using Cells = std::vector<std::string>;

const std::string kText =
    "lines:\n  - name: a\n    device: sim\n    serial: {baud: 38400, parity: none}\n"
    "    stations: [{id: 31, name: press, profile: autonics-gplp-s, points_file: /p/press.csv}]\n"
    "modbus_tcp: [{listen: 127.0.0.1:0}]\n";

/// A mistake in the third row of a table whose other rows are right, or in its head.
struct Mistake {
    Cells head;
    Cells row;
    int line;
    int column;
    std::string_view why;
};

/// Mistakes in the head.
const std::vector<Mistake> kOfHeads{
    {{"Name", "at"}, {"a", "UW5"}, 1, 1, "Name"},
    {{"name", "address"}, {"a", "UW5"}, 1, 2, "there is no column 'address'"},
    {{"name", "At"}, {"a", "UW5"}, 1, 2, "At"},
    {{"tag", "at"}, {"a", "UW5"}, 1, 1, "there is no column 'tag'"},
    {{"name", "at", "typ"}, {"a", "UW5", "u16"}, 1, 3, "type"},
    {{"name", "at", "Unit"}, {"a", "UW5", "bar"}, 1, 3, "Unit"},
    {{"name", "at", "units"}, {"a", "UW5", "bar"}, 1, 3, "unit"},
    {{"name", "at", "Scale"}, {"a", "UW5", "1"}, 1, 3, "Scale"},
    {{"name", "at", "factor"}, {"a", "UW5", "1"}, 1, 3, "there is no column 'factor'"},
    {{"name", "at", "description"}, {"a", "UW5", "x"}, 1, 3, "description"},
    {{"name", "at", "at"}, {"a", "UW5", "UW6"}, 1, 3, "there are two columns 'at'"},
    {{"name", "name", "at"}, {"a", "b", "UW5"}, 1, 2, "there are two columns 'name'"},
    {{"name", "type"}, {"a", "u16"}, 1, 1, "the column 'at' is missing"},
    {{"at", "type"}, {"UW5", "u16"}, 1, 1, "the column 'name' is missing"},
    {{"name", "at", ""}, {"a", "UW5", "x"}, 1, 3, "there is no column ''"},
    {{"name", "at "}, {"a", "UW5"}, 1, 2, "at"},
};

/// Mistakes in cells.
const std::vector<Mistake> kOfCells{
    {{"name", "at"}, {"", "UW5"}, 3, 1, "a point needs 'name'"},
    {{"name", "at"}, {"a", ""}, 3, 1, "a point needs 'at'"},
    {{"name", "at"}, {"Temp", "UW5"}, 3, 1, "write temp"},
    {{"name", "at"}, {"my temp", "UW5"}, 3, 1, "write my-temp"},
    {{"name", "at"}, {"z\xC3\xA4hler", "UW5"}, 3, 1, "name must be"},
    {{"name", "at"}, {"good", "UW5"}, 3, 1, "there are two points 'good'"},
    {{"name", "at"}, {"a", "40001"}, 3, 2, "40001"},
    {{"name", "at"}, {"a", "D100"}, 3, 2, "D100"},
    {{"name", "at"}, {"a", "UW"}, 3, 2, "UW"},
    {{"name", "at"}, {"a", "UW99999"}, 3, 2, "UW99999"},
    {{"name", "at"}, {"a", "UW 5"}, 3, 2, "UW 5"},
    {{"name", "at", "x"}, {"a", "UW5", "x"}, 1, 3, "there is no column 'x'"},
    {{"name", "at"}, {"a", "UW5", "more"}, 3, 3, "this row has 3 cells, the first one 2"},
    {{"name", "at", "type"}, {"a", "UW5", "float"}, 3, 3, "type must be"},
    {{"name", "at", "type"}, {"a", "UW5", "REAL"}, 3, 3, "type must be"},
    {{"name", "at", "type"}, {"a", "UW5", "U16"}, 3, 3, "type must be"},
    {{"name", "at", "type"}, {"a", "UW5", "int"}, 3, 3, "type must be"},
    {{"name", "at", "type"}, {"a", "UW5", "string"}, 3, 3, "length"},
    {{"name", "at", "word_order"}, {"a", "UW5", "cdab"}, 3, 3, "word_order must be"},
    {{"name", "at", "word_order"}, {"a", "UW5", "little"}, 3, 3, "word_order must be"},
    {{"name", "at", "scale"}, {"a", "UW5", "0"}, 3, 3, "scale"},
    {{"name", "at", "scale"}, {"a", "UW5", "0,1"}, 3, 3, "write 0.1, not 0,1"},
    {{"name", "at", "offset"}, {"a", "UW5", "-273,15"}, 3, 3, "write -273.15, not -273,15"},
    {{"name", "at", "min"}, {"a", "UW5", "1,5"}, 3, 3, "write 1.5, not 1,5"},
    {{"name", "at", "max"}, {"a", "UW5", "100,0"}, 3, 3, "write 100.0, not 100,0"},
    {{"name", "at", "scale"}, {"a", "UW5", "1/10"}, 3, 3, "scale must be"},
    {{"name", "at", "scale"}, {"a", "UW5", "x0.1"}, 3, 3, "scale must be"},
    {{"name", "at", "scale"}, {"a", "UW5", "#NV"}, 3, 3, "scale must be"},
    {{"name", "at", "min"}, {"a", "UW5", "low"}, 3, 3, "min must be"},
    {{"name", "at", "min", "max"}, {"a", "UW5", "9", "1"}, 3, 3, "m"},
    {{"name", "at", "writable"}, {"a", "UW5", "yes"}, 3, 3, "writable must be"},
    {{"name", "at", "writable"}, {"a", "UW5", "1"}, 3, 3, "writable must be"},
    {{"name", "at", "writable"}, {"a", "UW5", "WAHR"}, 3, 3, "writable must be"},
    {{"name", "at", "writable"}, {"a", "UW5", "R/W"}, 3, 3, "writable must be"},
    {{"name", "at", "overview"}, {"a", "UW5", "x"}, 3, 3, "overview must be"},
    {{"name", "at", "every"}, {"a", "UW5", "5"}, 3, 3, "every must be"},
    {{"name", "at", "every"}, {"a", "UW5", "5 sec"}, 3, 3, "every must be"},
    {{"name", "at", "every"}, {"a", "UW5", "0s"}, 3, 3, "every must be"},
    {{"name", "at", "labels"}, {"a", "UW5", "0=off"}, 3, 3, "labels"},
    {{"name", "at", "labels"}, {"a", "UW5", "{0: off"}, 3, 3, ""},
    {{"name", "at", "labels"}, {"a", "UW5", "{off: 0}"}, 3, 3, "labels are"},
    {{"name", "at", "no_value"}, {"a", "UW5", "-"}, 3, 3, "no_value"},
    {{"name", "at", "no_value"}, {"a", "UW5", "[none]"}, 3, 3, "no_value"},
    {{"name", "at", "report"}, {"a", "UW5", "0.5"}, 3, 3, "report"},
    {{"name", "at", "report"}, {"a", "UW5", "{dead: 1}"}, 3, 3, "dead"},
    {{"name", "at", "bit"}, {"a", "UW5", "16"}, 3, 3, "bit must be"},
    {{"name", "at", "bit"}, {"a", "UW5", "first"}, 3, 3, "bit must be"},
    {{"name", "at", "bit"}, {"a", "UB180", "1"}, 3, 3, "bit"},
    {{"name", "at", "length"}, {"a", "UW5", "8"}, 3, 3, "length"},
};

/// How spreadsheets write a table.
struct Guise {
    char separator;
    std::string_view line_end;
    std::string_view begin;
    bool quotes;
};
constexpr Guise kGuises[] = {{',', "\n", "", false},
                             {';', "\r\n", "", false},
                             {',', "\r\n", "\xEF\xBB\xBF", true},
                             {'\t', "\n", "", false}};

std::string written(const Cells& cells, const Guise& guise) {
    std::string text;
    for (std::size_t i = 0; i < cells.size(); ++i) {
        if (i > 0) text += guise.separator;
        const bool must = cells[i].find(guise.separator) != std::string::npos;
        text += guise.quotes || must ? '"' + cells[i] + '"' : cells[i];
    }
    return text + std::string(guise.line_end);
}

std::string table_of(const Mistake& mistake, const Guise& guise) {
    Cells good(mistake.head.size());
    for (std::size_t i = 0; i < good.size(); ++i)
        good[i] = mistake.head[i] == "name" ? "good" : mistake.head[i] == "at" ? "UW1" : "";
    return std::string(guise.begin) + written(mistake.head, guise) + written(good, guise) +
           written(mistake.row, guise);
}

TEST(PointsFileMistakes, EachIsToldWithRowAndColumnHoweverItIsWritten) {
    std::size_t told = 0;
    std::vector<Mistake> all = kOfHeads;
    all.insert(all.end(), kOfCells.begin(), kOfCells.end());
    for (const Mistake& mistake : all) {
        for (const Guise& guise : kGuises) {
            const std::string table = table_of(mistake, guise);
            yaml::Problems problems("f.yaml");
            EXPECT_FALSE(load(kText, MemoryFiles({{"/p/press.csv", table}}), problems)) << table;
            bool found = false;
            for (const yaml::Problem& one : problems.list())
                found = found || (one.file == "/p/press.csv" && one.mark.line == mistake.line &&
                                  one.mark.column == mistake.column &&
                                  one.message.find(mistake.why) != std::string::npos);
            EXPECT_TRUE(found) << table << problems.text();
            ++told;
        }
    }
    EXPECT_GE(told, 200U);
}

}  // namespace
}  // namespace panelgate::config::points_file_mistakes_test
