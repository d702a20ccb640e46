#include "panelgate/images/layout.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>

namespace panelgate::images {
namespace {

using modbus::Span;
using modbus::Table;
using points::Point;
using points::Quality;
using points::Type;
using testing::ElementsAre;
using Items = std::vector<std::uint16_t>;

class LayoutTest : public testing::Test {
  protected:
    LayoutTest() {
        add("level", Type::u16);
        add("flow", Type::f32);
        add("hot", Type::boolean);
        add("on", Type::boolean).bit = 3;
        settings.entries = {{"a", "level"}, {"a", "hot"}, {"", "", 2}, {"a", "flow"}, {"a", "on"}};
    }

    Point& add(const std::string& name, Type type) {
        Point& point = known[name];
        point.name = name;
        point.type = type;
        point.table = type == Type::boolean ? Table::coils : Table::holding_registers;
        return point;
    }

    Layout layout() const {
        return {settings, [this](std::string_view, std::string_view name) {
                    const auto found = known.find(std::string(name));
                    return found == known.end() ? nullptr : &found->second;
                }};
    }

    std::optional<Items> read(const Span& items, const std::vector<Shown>& shown) const {
        const Layout made = layout();
        const auto touched = made.touched(items);
        EXPECT_EQ(touched.size(), shown.size());
        return made.read(items, settings.stale, touched, shown);
    }

    bool is_whole(const Span& items) const {
        const Layout made = layout();
        return made.is_whole(items, made.touched(items));
    }

    static Span words(std::uint32_t first, std::uint32_t count) {
        return {Table::input_registers, first, count};
    }
    static Span bits(std::uint32_t first, std::uint32_t count) {
        return {Table::discrete_inputs, first, count};
    }

    std::map<std::string, Point> known;
    Settings settings;
    Items seven{7}, flow{1, 2}, one{1}, word{0x0008};
};

TEST_F(LayoutTest, RegistersAndBitsAreCountedApartInTheOrderOfTheList) {
    const Layout made = layout();
    EXPECT_EQ(made.size(Table::holding_registers), 5U);
    EXPECT_EQ(made.size(Table::discrete_inputs), 2U);
    EXPECT_EQ(made.places()[2].items, (Span{Table::holding_registers, 3, 2}));
    EXPECT_EQ(made.places()[3].items, (Span{Table::coils, 1, 1}));
}

TEST_F(LayoutTest, AReadShowsWhatThePanelHasAndZeroForFreeItems) {
    const Shown level{seven, Quality::good};
    const Shown good{flow, Quality::good};
    EXPECT_THAT(*read(words(0, 5), {level, good}), ElementsAre(7, 0, 0, 1, 2));
    EXPECT_THAT(*read(words(1, 2), {}), ElementsAre(0, 0));
    EXPECT_THAT(*read(words(2, 2), {good}), ElementsAre(0, 1));
    EXPECT_THAT(*read(words(4, 1), {good}), ElementsAre(2));
}

TEST_F(LayoutTest, ABitOfAWordIsABit) {
    EXPECT_THAT(*read(bits(0, 2), {{one, Quality::good}, {word, Quality::good}}),
                ElementsAre(1, 1));
}

TEST_F(LayoutTest, AValueThatIsNotGoodGivesNothingOrStays) {
    EXPECT_FALSE(read(words(0, 1), {{seven, Quality::stale}}));
    EXPECT_FALSE(read(words(0, 1), {{{}, Quality::bad}}));
    settings.stale = Stale::last;
    EXPECT_THAT(*read(words(0, 1), {{seven, Quality::bad}}), ElementsAre(7));
    EXPECT_FALSE(read(words(0, 1), {{{}, Quality::bad}})) << "no value was ever read";
}

TEST_F(LayoutTest, QualityStandsBehindEachPoint) {
    settings.quality = true;
    settings.stale = Stale::last;
    EXPECT_EQ(layout().size(Table::holding_registers), 7U);
    EXPECT_THAT(*read(words(0, 7), {{seven, Quality::stale}, {{}, Quality::bad}}),
                ElementsAre(7, 1, 0, 0, 0, 0, 2));
    EXPECT_THAT(*read(words(1, 1), {{seven, Quality::good}}), ElementsAre(0));
    EXPECT_THAT(*read(bits(0, 4), {{one, Quality::good}, {word, Quality::stale}}),
                ElementsAre(1, 0, 1, 1));
}

TEST_F(LayoutTest, AWriteIsOfWholePointsAndNothingElse) {
    EXPECT_TRUE(is_whole(words(0, 1)));
    EXPECT_TRUE(is_whole(words(3, 2)));
    EXPECT_TRUE(is_whole(bits(0, 2)));
    EXPECT_FALSE(is_whole(words(0, 2))) << "a free register";
    EXPECT_FALSE(is_whole(words(1, 1)));
    EXPECT_FALSE(is_whole(words(3, 1))) << "half of a value";
    EXPECT_FALSE(is_whole(words(4, 1)));
    settings.quality = true;
    EXPECT_TRUE(is_whole(words(0, 1)));
    EXPECT_FALSE(is_whole(words(0, 2))) << "a quality";
    EXPECT_FALSE(is_whole(words(1, 1)));
}

}  // namespace
}  // namespace panelgate::images
