#include "panelgate/profile/judge.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <string_view>

#include "panelgate/profile/load_profile.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::profile::translate_test {
namespace {

using modbus::Span;
using modbus::Table;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;

Bytes sent_to(const PanelProfile& panel, const Bytes& asked) {
    const auto other = translate(panel, test::request_of(asked));
    return other ? other->pdu() : Bytes{};
}

class TranslateTest : public ::testing::Test {
  protected:
    Bytes sent(std::string_view panel, const Bytes& asked) const {
        return sent_to(*catalogue.find(panel), asked);
    }
    Catalogue catalogue = Catalogue::shipped();
};

TEST_F(TranslateTest, WhatAPanelLacksForOneItemItIsAskedAsForSeveral) {
    const Bytes coil = "05 00 F0 FF 00"_hex;
    const Bytes word = "06 00 64 00 0A"_hex;
    const Bytes one_coil = "0F 00 F0 00 01 01 01"_hex;
    const Bytes one_word = "10 00 64 00 01 02 00 0A"_hex;
    EXPECT_EQ(sent("autonics-gplp-s", coil), one_coil);
    EXPECT_EQ(sent("autonics-gplp-s", word), one_word);
    EXPECT_EQ(sent("omron-cp2e", coil), one_coil);
    EXPECT_EQ(sent("autonics-gp-2005", word), one_word);
}

TEST_F(TranslateTest, WhatAPanelHasOrCannotTakeEitherWayGoesAsItCame) {
    for (const char* panel : {"omron-cp2e", "panasonic-gt", "autonics-arm", "generic"})
        EXPECT_EQ(sent(panel, "06 00 64 00 0A"_hex), Bytes{}) << panel;
    EXPECT_EQ(sent("panasonic-gt", "05 00 10 FF 00"_hex), Bytes{});
    EXPECT_EQ(sent("autonics-gp-2005", "05 00 F0 FF 00"_hex), Bytes{}) << "it has no 0F either";
}

TEST_F(TranslateTest, InputsStayInputsWhereNothingSaysThatTheMemoryIsTheSame) {
    EXPECT_EQ(sent("autonics-gplp-s", "04 00 00 00 05"_hex), Bytes{})
        << "the manual's own example is refused";
    EXPECT_EQ(sent("autonics-gplp-s", "02 01 20 00 05"_hex), Bytes{});
    EXPECT_EQ(sent("panasonic-gt", "02 00 20 00 05"_hex), Bytes{});
}

/// Words 10 to 99 by 03, also as bits in coils and as input registers, without function 04; and
/// separate coils.
PanelProfile panel_with_shared_words() {
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
    PanelProfile panel;
    panel.functions = {{3, 0, false, ""}};
    panel.areas = {words, bits, relays};
    return panel;
}

TEST_F(TranslateTest, InputsAreReadAsWhatTheProfileSaysIsTheSame) {
    const PanelProfile panel = panel_with_shared_words();
    EXPECT_EQ(sent_to(panel, "04 00 0A 00 5A"_hex), "03 00 0A 00 5A"_hex);
    EXPECT_EQ(sent_to(panel, "04 00 0A 00 5B"_hex), Bytes{}) << "beyond the area";
    EXPECT_EQ(sent_to(panel, "04 00 09 00 01"_hex), Bytes{});
    EXPECT_EQ(sent_to(panel, "02 00 A0 00 01"_hex), Bytes{}) << "no bits are declared";
}

TEST_F(TranslateTest, SaysBeforehandWhatItMayDo) {
    const auto of = [&](std::string_view panel) { return translations(*catalogue.find(panel)); };
    EXPECT_THAT(of("autonics-gplp-s"), ElementsAre(Translation{5, 15}, Translation{6, 16}));
    EXPECT_THAT(of("autonics-gp-2005"), ElementsAre(Translation{6, 16}));
    EXPECT_THAT(of("omron-cp2e"), ElementsAre(Translation{5, 15}));
    for (const char* panel : {"autonics-arm", "panasonic-gt", "generic"})
        EXPECT_THAT(of(panel), IsEmpty()) << panel;
    EXPECT_THAT(translations(panel_with_shared_words()), ElementsAre(Translation{4, 3}));
}

TEST_F(TranslateTest, NoReadBecomesAWrite) {
    for (const auto& [name, panel] : catalogue.all()) {
        for (const Bytes& read : {"01 00 00 00 01"_hex, "02 00 00 00 01"_hex, "03 00 00 00 01"_hex,
                                  "04 00 00 00 01"_hex}) {
            const auto other = translate(panel, test::request_of(read));
            EXPECT_TRUE(!other || other->is_read()) << name;
        }
    }
}

MATCHER_P(Shows, items, "") {
    return std::ranges::any_of(arg, [&](const Span& span) { return span.overlaps(items); });
}

TEST(ShownAs, AWordIsItsBitsAndWhatItsOtherTablesShowAndBitsAreTheirWords) {
    const PanelProfile panel = panel_with_shared_words();
    const auto words = shown_as(panel, {Table::holding_registers, 20, 2});
    EXPECT_THAT(words, Contains(Span{Table::input_registers, 20, 2}));
    EXPECT_THAT(words, Contains(Span{Table::coils, 320, 32}));
    EXPECT_THAT(words, Not(Shows(Span{Table::coils, 352, 1000})));
    EXPECT_THAT(words, Not(Shows(Span{Table::coils, 5000, 100})));
    const auto bits = shown_as(panel, {Table::coils, 335, 2});
    EXPECT_THAT(bits, Contains(Span{Table::holding_registers, 20, 2}));
    EXPECT_THAT(bits, Contains(Span{Table::input_registers, 20, 2}));
    EXPECT_THAT(bits, Not(Shows(Span{Table::holding_registers, 22, 78})));
}

TEST(ShownAs, OnlyWhatLiesInAnAreaIsShownElsewhere) {
    const PanelProfile panel = panel_with_shared_words();
    EXPECT_THAT(shown_as(panel, {Table::coils, 5000, 1}),
                ElementsAre(Span{Table::coils, 5000, 1}, Span{Table::coils, 5000, 1}));
    EXPECT_THAT(shown_as(panel, {Table::holding_registers, 200, 5}),
                ElementsAre(Span{Table::holding_registers, 200, 5}));
    EXPECT_THAT(shown_as(panel, {Table::holding_registers, 0, 200}),
                Contains(Span{Table::coils, 160, 1440}));
}

}  // namespace
}  // namespace panelgate::profile::translate_test
