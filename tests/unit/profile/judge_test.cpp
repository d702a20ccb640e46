#include "panelgate/profile/judge.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "panelgate/profile/load_profile.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::profile::judge_test {
namespace {

using modbus::Span;
using modbus::Table;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;

FunctionRule rule(std::uint8_t code, unsigned max_count = 0) {
    return {code, max_count, false, ""};
}
Area area(std::string name, Table table, AddressRange readable) {
    Area made;
    made.name = std::move(name);
    made.table = table;
    made.readable = readable;
    return made;
}

TEST(AddressRange, HoldsItemsOnlyAsAWhole) {
    const AddressRange range{10, 19};
    EXPECT_TRUE(range.contains(10));
    EXPECT_TRUE(range.contains(19));
    EXPECT_TRUE(range.contains(10, 10));
    EXPECT_FALSE(range.contains(9));
    EXPECT_FALSE(range.contains(20));
    EXPECT_FALSE(range.contains(9, 2));
    EXPECT_FALSE(range.contains(10, 11));
    EXPECT_FALSE(range.contains(19, 2));
    const AddressRange all{0, 65535};
    EXPECT_TRUE(all.contains(0, 65536));
    EXPECT_FALSE(all.contains(1, 65536));
    EXPECT_FALSE(all.contains(1, 0xFFFF'FFFF)) << "the sum overflows";
    EXPECT_FALSE(all.contains(0xFFFF'FFFF, 2));
}

TEST(Allows, AnEmptyListAllowsEverything) {
    EXPECT_TRUE(allows<int>({}, 9600));
    EXPECT_TRUE(allows<int>({9600, 19200}, 19200));
    EXPECT_FALSE(allows<int>({9600, 19200}, 38400));
}

TEST(PanelProfile, OneWithoutFunctionsTakesAll) {
    PanelProfile profile;
    EXPECT_TRUE(profile.has_function(3));
    EXPECT_TRUE(profile.has_function(65));
    EXPECT_EQ(profile.find_function(3), nullptr);
    profile.functions = {rule(3)};
    EXPECT_TRUE(profile.has_function(3));
    EXPECT_FALSE(profile.has_function(65));
}

TEST(PanelProfile, WhereTheManualGivesNoLimitTheStandardDoes) {
    PanelProfile profile;
    profile.functions = {rule(1), rule(3, 16), rule(16), rule(15)};
    EXPECT_EQ(profile.max_count(3), 16u);
    EXPECT_EQ(profile.max_count(1), 2000u);
    EXPECT_EQ(profile.max_count(2), 2000u) << "of one that is not listed, too";
    EXPECT_EQ(profile.max_count(4), 125u);
    EXPECT_EQ(profile.max_count(15), 1968u);
    EXPECT_EQ(profile.max_count(16), 123u);
    EXPECT_EQ(profile.max_count(5), 1u);
    EXPECT_EQ(profile.max_count(6), 1u);
}

TEST(PanelProfile, TheFirstAreaThatReachesAnItemIsItsArea) {
    PanelProfile profile;
    profile.areas = {area("clock", Table::holding_registers, {100, 109}),
                     area("D", Table::holding_registers, {0, 999}),
                     area("W", Table::coils, {0, 999})};
    profile.areas[1].also = {Table::input_registers};
    const auto found = [&](Table table, std::uint32_t address) {
        const Area* one = profile.find_area(table, address);
        return one == nullptr ? std::string("none") : one->name;
    };
    EXPECT_EQ(found(Table::holding_registers, 99), "D");
    EXPECT_EQ(found(Table::holding_registers, 100), "clock");
    EXPECT_EQ(found(Table::input_registers, 100), "D") << "the clock is not there";
    EXPECT_EQ(found(Table::coils, 100), "W");
    EXPECT_EQ(found(Table::discrete_inputs, 100), "none");
    EXPECT_EQ(found(Table::holding_registers, 1000), "none");
    EXPECT_EQ(profile.find_area("W"), &profile.areas[2]);
    EXPECT_EQ(profile.find_area("w"), nullptr);
}

Bytes sent_to(const PanelProfile& panel, const Bytes& asked) {
    const auto other = translate(panel, test::request_of(asked));
    return other ? other->pdu() : Bytes{};
}

class Judge : public ::testing::Test {
  protected:
    Judgement judged(std::string_view panel, const Bytes& pdu) const {
        return judge(*shipped.find(panel), pdu);
    }
    std::string why(std::string_view panel, const Bytes& pdu) const {
        return explain(*shipped.find(panel), test::request_of(pdu));
    }
    Bytes sent(std::string_view panel, const Bytes& asked) const {
        return sent_to(*shipped.find(panel), asked);
    }
    const Catalogue shipped = Catalogue::shipped();
};
class Translate : public Judge {};

TEST_F(Judge, SaysWhatTheManualSays) {
    const std::string_view press = "autonics-gplp-s";
    EXPECT_EQ(judged(press, "03 00 00 00 05"_hex), Judgement::fine);
    EXPECT_EQ(judged(press, "03 00 00 00 7E"_hex), Judgement::illegal_value) << "too many";
    EXPECT_EQ(judged(press, "03 00 00 00 00"_hex), Judgement::illegal_value) << "none";
    EXPECT_EQ(judged(press, "03 FF FF 00 01"_hex), Judgement::illegal_address);
    EXPECT_EQ(judged(press, "17 00 00 00 01 00 00 00 01 02 00 00"_hex),
              Judgement::illegal_function);
    EXPECT_EQ(judged("generic", ""_hex), Judgement::illegal_function);
    EXPECT_EQ(judged("generic", "05 00 00 12 34"_hex), Judgement::illegal_value) << "no coil's";
    EXPECT_EQ(judged("generic", "10 00 00 00 02 02 00 01"_hex), Judgement::illegal_value)
        << "the byte count contradicts";
    EXPECT_EQ(judged("generic", "10 00 00 00 02 04 00 01 00 02"_hex), Judgement::fine);
}

TEST_F(Judge, ExplainsItselfInWordsOfThePanel) {
    EXPECT_EQ(why("autonics-gplp-s", "03 00 00 00 05"_hex), "");
    EXPECT_EQ(why("autonics-gplp-s", "17 00 00 00 01 00 00 00 01 02 00 00"_hex),
              "autonics-gplp-s has no function 23");
    EXPECT_EQ(why("generic", "05 00 00 12 34"_hex), "function 5 does not take these values");
}

TEST_F(Judge, KnowsWhatCanBeReadAndNotWritten) {
    int found = 0;
    for (const auto& [name, profile] : shipped.all()) {
        for (const Area& one : profile.areas) {
            if (one.table != Table::holding_registers || one.writable) continue;
            if (profile.find_function(6) == nullptr) continue;
            if (profile.find_area(one.table, one.readable.first) != &one) continue;
            const auto address = static_cast<std::uint16_t>(one.readable.first);
            EXPECT_EQ(judge(profile, modbus::encode_write_register(address, 1)),
                      Judgement::write_protected)
                << name << ' ' << one.name;
            ++found;
        }
    }
    EXPECT_GT(found, 0);
}

TEST_F(Translate, WhatAPanelLacksForOneItemItIsAskedAsForSeveral) {
    const Bytes coil = "05 00 F0 FF 00"_hex;
    const Bytes word = "06 00 64 00 0A"_hex;
    const Bytes one_coil = "0F 00 F0 00 01 01 01"_hex;
    const Bytes one_word = "10 00 64 00 01 02 00 0A"_hex;
    EXPECT_EQ(sent("autonics-gplp-s", coil), one_coil);
    EXPECT_EQ(sent("autonics-gplp-s", word), one_word);
    EXPECT_EQ(sent("omron-cp2e", coil), one_coil);
    EXPECT_EQ(sent("autonics-gp-2005", word), one_word);
}

TEST_F(Translate, WhatAPanelHasOrCannotTakeEitherWayGoesAsItCame) {
    for (const char* panel : {"omron-cp2e", "panasonic-gt", "autonics-arm", "generic"})
        EXPECT_EQ(sent(panel, "06 00 64 00 0A"_hex), Bytes{}) << panel;
    EXPECT_EQ(sent("panasonic-gt", "05 00 10 FF 00"_hex), Bytes{});
    EXPECT_EQ(sent("autonics-gp-2005", "05 00 F0 FF 00"_hex), Bytes{}) << "it has no 0F either";
}

TEST_F(Translate, InputsStayInputsWhereNothingSaysThatTheMemoryIsTheSame) {
    EXPECT_EQ(sent("autonics-gplp-s", "04 00 00 00 05"_hex), Bytes{})
        << "the manual's own example is refused";
    EXPECT_EQ(sent("autonics-gplp-s", "02 01 20 00 05"_hex), Bytes{});
    EXPECT_EQ(sent("panasonic-gt", "02 00 20 00 05"_hex), Bytes{});
}

/// Words 10 to 99 by 03, also as bits in coils and as input registers, without function 04; and
/// separate coils.
PanelProfile panel_with_shared_words() {
    PanelProfile panel;
    panel.functions = {rule(3)};
    panel.areas = {area("UW", Table::holding_registers, {10, 99}),
                   area("UB", Table::coils, {160, 1599}), area("R", Table::coils, {5000, 5099})};
    panel.areas[0].also = {Table::input_registers};
    panel.areas[1].view_of = "UW";
    return panel;
}

TEST_F(Translate, InputsAreReadAsWhatTheProfileSaysIsTheSame) {
    const PanelProfile panel = panel_with_shared_words();
    EXPECT_EQ(sent_to(panel, "04 00 0A 00 5A"_hex), "03 00 0A 00 5A"_hex);
    EXPECT_EQ(sent_to(panel, "04 00 0A 00 5B"_hex), Bytes{}) << "beyond the area";
    EXPECT_EQ(sent_to(panel, "04 00 09 00 01"_hex), Bytes{});
    EXPECT_EQ(sent_to(panel, "02 00 A0 00 01"_hex), Bytes{}) << "no bits are declared";
}

TEST_F(Translate, SaysBeforehandWhatItMayDo) {
    const auto of = [&](std::string_view panel) { return translations(*shipped.find(panel)); };
    EXPECT_THAT(of("autonics-gplp-s"), ElementsAre(Translation{5, 15}, Translation{6, 16}));
    EXPECT_THAT(of("autonics-gp-2005"), ElementsAre(Translation{6, 16}));
    EXPECT_THAT(of("omron-cp2e"), ElementsAre(Translation{5, 15}));
    for (const char* panel : {"autonics-arm", "panasonic-gt", "generic"})
        EXPECT_THAT(of(panel), IsEmpty()) << panel;
    EXPECT_THAT(translations(panel_with_shared_words()), ElementsAre(Translation{4, 3}));
}

TEST_F(Translate, NoReadBecomesAWrite) {
    for (const auto& [name, panel] : shipped.all()) {
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
}  // namespace panelgate::profile::judge_test
