#include "panelgate/profile/translate.hpp"

#include <gmock/gmock.h>

#include <algorithm>

namespace panelgate::profile::shown_as_test {
namespace {

using modbus::Span;
using modbus::Table;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::Not;

/// Words 10 to 99, also as bits in coils and as input registers; and separate coils.
PanelProfile panel() {
    Area words;
    words.name = "UW";
    words.table = Table::holding_registers;
    words.also = {Table::input_registers};
    words.readable = {10, 99};
    Area bits;
    bits.name = "UB";
    bits.table = Table::coils;
    bits.readable = {160, 1599};
    bits.view_of = "UW";
    Area relays;
    relays.name = "R";
    relays.table = Table::coils;
    relays.readable = {5000, 5099};
    PanelProfile made;
    made.areas = {words, bits, relays};
    return made;
}

MATCHER_P(Shows, items, "") {
    return std::ranges::any_of(arg, [&](const Span& span) { return span.overlaps(items); });
}

TEST(ShownAs, AWordIsItsBitsAndWhatItsOtherTablesShow) {
    const auto shown = shown_as(panel(), {Table::holding_registers, 20, 2});
    EXPECT_THAT(shown, Contains(Span{Table::input_registers, 20, 2}));
    EXPECT_THAT(shown, Contains(Span{Table::coils, 320, 32}));
    EXPECT_THAT(shown, Not(Shows(Span{Table::coils, 352, 1000})));
    EXPECT_THAT(shown, Not(Shows(Span{Table::coils, 5000, 100})));
}

TEST(ShownAs, BitsAreTheWordsThatHoldThem) {
    const auto shown = shown_as(panel(), {Table::coils, 335, 2});
    EXPECT_THAT(shown, Contains(Span{Table::holding_registers, 20, 2}));
    EXPECT_THAT(shown, Contains(Span{Table::input_registers, 20, 2}));
    EXPECT_THAT(shown, Not(Shows(Span{Table::holding_registers, 22, 78})));
}

TEST(ShownAs, OnlyWhatLiesInAnAreaIsShownElsewhere) {
    EXPECT_THAT(shown_as(panel(), {Table::coils, 5000, 1}),
                ElementsAre(Span{Table::coils, 5000, 1}, Span{Table::coils, 5000, 1}));
    EXPECT_THAT(shown_as(panel(), {Table::holding_registers, 200, 5}),
                ElementsAre(Span{Table::holding_registers, 200, 5}));
    EXPECT_THAT(shown_as(panel(), {Table::holding_registers, 0, 200}),
                Contains(Span{Table::coils, 160, 1440}));
}

}  // namespace
}  // namespace panelgate::profile::shown_as_test
