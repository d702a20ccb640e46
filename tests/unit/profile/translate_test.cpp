#include "panelgate/profile/translate.hpp"

#include <gtest/gtest.h>

#include <string_view>
#include <vector>

#include "panelgate/profile/load_profile.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::profile::translate_test {
namespace {

using modbus::Table;

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

TEST_F(TranslateTest, WhatAPanelHasGoesAsItCame) {
    for (const char* panel : {"omron-cp2e", "panasonic-gt", "autonics-arm", "generic"})
        EXPECT_EQ(sent(panel, "06 00 64 00 0A"_hex), Bytes{}) << panel;
    EXPECT_EQ(sent("panasonic-gt", "05 00 10 FF 00"_hex), Bytes{});
}

TEST_F(TranslateTest, WithoutTheOtherFunctionItGoesAsItCame) {
    EXPECT_EQ(sent("autonics-gp-2005", "05 00 F0 FF 00"_hex), Bytes{}) << "it has no 0F either";
}

TEST_F(TranslateTest, InputsStayInputsWhereNothingSaysThatTheMemoryIsTheSame) {
    EXPECT_EQ(sent("autonics-gplp-s", "04 00 00 00 05"_hex), Bytes{})
        << "the manual's own example is refused";
    EXPECT_EQ(sent("autonics-gplp-s", "02 01 20 00 05"_hex), Bytes{});
    EXPECT_EQ(sent("panasonic-gt", "02 00 20 00 05"_hex), Bytes{});
}

/// Words 100 to 199 by 03, also shown as input registers; no function 04.
PanelProfile panel_with_shared_words() {
    PanelProfile panel;
    panel.functions = {{3, 0, false, ""}};
    Area words;
    words.name = "D";
    words.also = {Table::input_registers};
    words.readable = {100, 199};
    panel.areas = {words};
    return panel;
}

TEST_F(TranslateTest, InputsAreReadAsWhatTheProfileSaysIsTheSame) {
    const PanelProfile panel = panel_with_shared_words();
    EXPECT_EQ(sent_to(panel, "04 00 64 00 64"_hex), "03 00 64 00 64"_hex);
    EXPECT_EQ(sent_to(panel, "04 00 64 00 65"_hex), Bytes{}) << "beyond the area";
    EXPECT_EQ(sent_to(panel, "04 00 63 00 01"_hex), Bytes{});
    EXPECT_EQ(sent_to(panel, "02 00 64 00 01"_hex), Bytes{}) << "no bits are declared";
}

TEST_F(TranslateTest, SaysBeforehandWhatItMayDo) {
    const auto of = [&](std::string_view panel) { return translations(*catalogue.find(panel)); };
    EXPECT_EQ(of("autonics-gplp-s"), (std::vector<Translation>{{5, 15}, {6, 16}}));
    EXPECT_EQ(of("autonics-gp-2005"), (std::vector<Translation>{{6, 16}}));
    EXPECT_EQ(of("omron-cp2e"), (std::vector<Translation>{{5, 15}}));
    for (const char* panel : {"autonics-arm", "panasonic-gt", "generic"})
        EXPECT_TRUE(of(panel).empty()) << panel;
    EXPECT_EQ(translations(panel_with_shared_words()), (std::vector<Translation>{{4, 3}}));
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

}  // namespace
}  // namespace panelgate::profile::translate_test
