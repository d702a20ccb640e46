#include "plan.hpp"

#include <gmock/gmock.h>

#include <algorithm>

#include "virtual_line.hpp"

namespace panelgate::scan::plan_test {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::Field;

std::vector<std::string> texts(const std::vector<SerialFormat>& formats) {
    std::vector<std::string> all;
    for (const SerialFormat& format : formats) all.push_back(to_string(format));
    return all;
}

TEST(LikelyFormats, BeginWithTheProfilesDefaultsThenTheStandardsThenTheUsualOnes) {
    const auto formats = texts(likely_formats(shipped(), {}));
    ASSERT_EQ(formats.size(), 21u);
    EXPECT_EQ(std::vector<std::string>(formats.begin(), formats.begin() + 6),
              (std::vector<std::string>{"38400 8N1", "9600 8N1", "9600 8E1", "9600 8O1",
                                        "19200 8E1", "19200 8N1"}));
    EXPECT_EQ(formats.back(), "2400 8O1");
}

TEST(LikelyFormats, AreOnlyWhatTheListsAllow) {
    Settings settings;
    settings.baud = {31250, 9600};
    settings.parity = {Parity::even, Parity::odd};
    EXPECT_THAT(texts(likely_formats(shipped(), settings)),
                ElementsAre("9600 8E1", "9600 8O1", "31250 8E1", "31250 8O1"));
    settings.remote = true;
    EXPECT_EQ(likely_formats(shipped(), settings).size(), 1u);
}

TEST(AsciiFormats, AreTheStandardsThenWhatElseIsUsual) {
    const auto formats = texts(ascii_formats({}));
    ASSERT_EQ(formats.size(), 16u);
    EXPECT_EQ(formats[0], "9600 7E1 ASCII");
    EXPECT_EQ(formats[4], "9600 8N1 ASCII");
    EXPECT_EQ(formats[8], "9600 7O1 ASCII");
    EXPECT_EQ(formats[12], "9600 7N2 ASCII");
    Settings settings;
    settings.baud = {9600};
    settings.parity = {Parity::even};
    EXPECT_THAT(texts(ascii_formats(settings)), ElementsAre("9600 7E1 ASCII"));
    settings.remote = true;
    EXPECT_EQ(ascii_formats(settings).size(), 1u);
}

TEST(LikelyStations, BeginWithTheEndsOfTheProfilesRanges) {
    const auto usual = likely_stations(shipped(), {});
    EXPECT_EQ(usual.size(), 31u);
    EXPECT_EQ(std::vector<std::uint8_t>(usual.begin(), usual.begin() + 4),
              (std::vector<std::uint8_t>{1, 31, 2, 3}));
    Settings settings;
    settings.stations = {5, 99, 100};
    EXPECT_THAT(likely_stations(shipped(), settings), ElementsAre(99, 5, 100));
}

TEST(SearchPlan, TriesAFewStationsInEveryFormatBeforeItTriesMore) {
    const SerialFormat a{9600, 8, Parity::none, 1};
    const SerialFormat b{9600, 8, Parity::even, 1};
    SearchPlan plan({a, b}, {1, 2, 3, 4, 5});
    std::vector<Cell> cells;
    std::vector<bool> last;
    while (const auto cell = plan.next()) {
        cells.push_back(*cell);
        last.push_back(plan.is_last_of_format());
    }
    EXPECT_THAT(cells, ElementsAre(Cell{a, 1}, Cell{a, 2}, Cell{a, 3}, Cell{a, 4}, Cell{b, 1},
                                   Cell{b, 2}, Cell{b, 3}, Cell{b, 4}, Cell{a, 5}, Cell{b, 5}));
    EXPECT_THAT(last,
                ElementsAre(false, false, false, true, false, false, false, true, true, true));
}

TEST(SearchPlan, TriesTheOtherParitiesFirstWhereSomethingDamagedAnswered) {
    const auto formats = likely_formats(shipped(), {});
    SearchPlan plan(formats, likely_stations(shipped(), {}));
    const auto first = plan.next();
    plan.hint({{19200, 8, Parity::none, 1}, 31});
    std::vector<Cell> cells;
    while (const auto cell = plan.next()) cells.push_back(*cell);
    EXPECT_EQ(cells.size(), 21u * 31u - 1) << "none is lost";
    EXPECT_EQ(cells[0], (Cell{{19200, 8, Parity::even, 1}, 31}));
    EXPECT_EQ(cells[1].format.baud, 19200);
    EXPECT_EQ(cells[2].format.baud, 19200);
    EXPECT_THAT(std::vector<Cell>(cells.begin(), cells.begin() + 21),
                Each(Field(&Cell::station, 31)));
    EXPECT_EQ(first->station, 1);
}

TEST(SearchPlan, CostsAboutAMinuteWhenNothingAnswersAtAll) {
    const SearchPlan plan(likely_formats(shipped(), {}), likely_stations(shipped(), {}));
    EXPECT_LT(plan.cost({}), 75s);
    SearchPlan with_ascii = plan;
    with_ascii.add(ascii_formats({}), likely_stations(shipped(), {}));
    EXPECT_LT(with_ascii.cost({}), 2min);
}

}  // namespace
}  // namespace panelgate::scan::plan_test
