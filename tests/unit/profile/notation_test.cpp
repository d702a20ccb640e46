#include "panelgate/profile/notation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "panelgate/profile/load_profile.hpp"

namespace panelgate::profile::notation_test {
namespace {

using modbus::Table;

const PanelProfile& shipped(std::string_view name) {
    static const Catalogue catalogue = Catalogue::shipped();
    return *catalogue.find(name);
}

const std::vector<std::string> kShipped{"autonics-gplp-s", "autonics-gplp-a", "autonics-gp-2005",
                                        "autonics-arm",    "panasonic-gt",    "omron-cp2e",
                                        "generic"};

std::string error_of(std::string_view profile, std::string_view text) {
    const auto item = parse_notation(shipped(profile), text);
    return item ? "found " + format_notation(*item->area, item->address) : item.error().message;
}

NotationError::Kind kind_of(std::string_view profile, std::string_view text) {
    return parse_notation(shipped(profile), text).error().kind;
}

struct Row {
    const char* profile;
    const char* notation;
    Table table;
    unsigned address;
};

std::string name_of(const ::testing::TestParamInfo<std::string>& info) {
    std::string name = info.param;
    for (char& c : name) c = c == '-' ? '_' : c;
    return name;
}

class EveryShippedProfile : public ::testing::TestWithParam<std::string> {};

TEST_P(EveryShippedProfile, ReadsBackEveryItemItWrites) {
    const PanelProfile& profile = shipped(GetParam());
    for (const Area& area : profile.areas) {
        for (std::uint32_t at = area.readable.first; at <= area.readable.last; ++at) {
            const auto address = static_cast<std::uint16_t>(at);
            const std::string text = format_notation(area, address);
            const auto item = parse_notation(profile, text);
            ASSERT_TRUE(item) << text << ": " << item.error().message;
            ASSERT_EQ(item->area, &area) << text;
            ASSERT_EQ(item->address, address) << text;
        }
    }
}

TEST_P(EveryShippedProfile, KnowsNoItemBesideItsAreas) {
    const PanelProfile& profile = shipped(GetParam());
    for (const Area& area : profile.areas) {
        if (area.readable.last == 65535) continue;
        const auto next = static_cast<std::uint16_t>(area.readable.last + 1);
        const std::string text = format_notation(area, next);
        const auto item = parse_notation(profile, text);
        ASSERT_FALSE(item) << text;
        EXPECT_EQ(item.error().kind, NotationError::Kind::out_of_range) << text;
    }
}

INSTANTIATE_TEST_SUITE_P(Notation, EveryShippedProfile, ::testing::ValuesIn(kShipped), name_of);

class ArithmeticOfTheManuals : public ::testing::TestWithParam<Row> {};

TEST_P(ArithmeticOfTheManuals, AgreesBothWays) {
    const Row& row = GetParam();
    const PanelProfile& profile = shipped(row.profile);
    const auto item = parse_notation(profile, row.notation);
    ASSERT_TRUE(item) << item.error().message;
    EXPECT_EQ(item->area->table, row.table);
    EXPECT_EQ(item->address, row.address);
    EXPECT_EQ(format_notation(profile, row.table, item->address), row.notation);
}

constexpr Table kCoil = Table::coils;
constexpr Table kInput = Table::discrete_inputs;
constexpr Table kInputWord = Table::input_registers;
constexpr Table kWord = Table::holding_registers;

INSTANTIATE_TEST_SUITE_P(
    AutonicsGp, ArithmeticOfTheManuals,
    ::testing::Values(
        Row{"autonics-gplp-s", "UB180", kCoil, 288}, Row{"autonics-gplp-s", "UB1000", kCoil, 1600},
        Row{"autonics-gplp-s", "UB1878", kCoil, 3000}, Row{"autonics-gplp-s", "UB0", kCoil, 0},
        Row{"autonics-gplp-s", "UB150", kCoil, 240}, Row{"autonics-gplp-a", "UB810", kCoil, 1296},
        Row{"autonics-gplp-s", "UB4095F", kCoil, 65535},
        Row{"autonics-gplp-s", "UB4094F", kCoil, 65519}, Row{"autonics-gplp-s", "UW0", kWord, 0},
        Row{"autonics-gplp-s", "UW100", kWord, 100}, Row{"autonics-gplp-s", "UW15", kWord, 15},
        Row{"autonics-gplp-a", "UW81", kWord, 81}, Row{"autonics-gplp-s", "UW6047", kWord, 6047},
        Row{"autonics-gplp-a", "UW65535", kWord, 65535}, Row{"autonics-gp-2005", "UW30", kWord, 30},
        Row{"autonics-gp-2005", "UW100", kWord, 100}));
INSTANTIATE_TEST_SUITE_P(AutonicsArm, ArithmeticOfTheManuals,
                         ::testing::Values(Row{"autonics-arm", "000001", kCoil, 0},
                                           Row{"autonics-arm", "000008", kCoil, 7},
                                           Row{"autonics-arm", "000010", kCoil, 9},
                                           Row{"autonics-arm", "100008", kInput, 7},
                                           Row{"autonics-arm", "100010", kInput, 9},
                                           Row{"autonics-arm", "300001", kInputWord, 0},
                                           Row{"autonics-arm", "300110", kInputWord, 109},
                                           Row{"autonics-arm", "301024", kInputWord, 1023},
                                           Row{"autonics-arm", "400001", kWord, 0},
                                           Row{"autonics-arm", "400301", kWord, 300},
                                           Row{"autonics-arm", "401029", kWord, 1028},
                                           Row{"autonics-arm", "401030", kWord, 1029}));
INSTANTIATE_TEST_SUITE_P(PanasonicGt, ArithmeticOfTheManuals,
                         ::testing::Values(Row{"panasonic-gt", "GR20", kCoil, 32},
                                           Row{"panasonic-gt", "GR173", kCoil, 275},
                                           Row{"panasonic-gt", "GR12F", kCoil, 207},
                                           Row{"panasonic-gt", "GR255F", kCoil, 4095},
                                           Row{"panasonic-gt", "GDT108", kWord, 108},
                                           Row{"panasonic-gt", "GDT510", kWord, 510},
                                           Row{"panasonic-gt", "GDT1230", kWord, 1230},
                                           Row{"panasonic-gt", "GDT2047", kWord, 2047},
                                           Row{"panasonic-gt", "GDT9080", kWord, 9080},
                                           Row{"panasonic-gt", "GDT9086", kWord, 9086}));
INSTANTIATE_TEST_SUITE_P(OmronCp2e, ArithmeticOfTheManuals,
                         ::testing::Values(Row{"omron-cp2e", "W0.00", kCoil, 0},
                                           Row{"omron-cp2e", "W127.15", kCoil, 2047},
                                           Row{"omron-cp2e", "W1.04", kCoil, 20},
                                           Row{"omron-cp2e", "W2.06", kCoil, 38},
                                           Row{"omron-cp2e", "D1000", kWord, 1000},
                                           Row{"omron-cp2e", "D4095", kWord, 4095},
                                           Row{"omron-cp2e", "D8191", kWord, 8191},
                                           Row{"omron-cp2e", "D16383", kWord, 16383}));
INSTANTIATE_TEST_SUITE_P(Standard, ArithmeticOfTheManuals,
                         ::testing::Values(Row{"generic", "065536", kCoil, 65535},
                                           Row{"generic", "001001", kCoil, 1000},
                                           Row{"generic", "100001", kInput, 0},
                                           Row{"generic", "300001", kInputWord, 0},
                                           Row{"generic", "465536", kWord, 65535}));

TEST(Notation, TakesLeadingZerosAsPadding) {
    for (const char* text : {"UB180", "UB0180", "UB00180", "ub180", "Ub000000180"}) {
        const auto item = parse_notation(shipped("autonics-gplp-s"), text);
        ASSERT_TRUE(item) << text;
        EXPECT_EQ(item->address, 288) << text;
    }
    EXPECT_EQ(parse_notation(shipped("omron-cp2e"), "W001.04")->address, 20);
}

TEST(Notation, TakesLettersInAnyCase) {
    EXPECT_EQ(parse_notation(shipped("panasonic-gt"), "gr12f")->address, 207);
    EXPECT_EQ(parse_notation(shipped("panasonic-gt"), "gDt108")->address, 108);
    EXPECT_EQ(parse_notation(shipped("autonics-gplp-s"), "ub4095f")->address, 65535);
}

TEST(Notation, ReadsTheLastDigitOfABitAsHexAndTheRestAsDecimal) {
    EXPECT_EQ(parse_notation(shipped("autonics-gplp-s"), "UBF").has_value(), false);
    EXPECT_EQ(parse_notation(shipped("autonics-gplp-s"), "UB0F")->address, 15);
    EXPECT_EQ(parse_notation(shipped("autonics-gplp-s"), "UB10")->address, 16);
    EXPECT_FALSE(parse_notation(shipped("autonics-gplp-s"), "UB1A0"));
    EXPECT_EQ(format_notation(*shipped("autonics-gplp-s").find_area("UB"), 9), "UB9");
    EXPECT_EQ(format_notation(*shipped("autonics-gplp-s").find_area("UB"), 10), "UB0A");
}

TEST(Notation, KnowsTheFiveDigitSpellingOfTheArm) {
    const PanelProfile& arm = shipped("autonics-arm");
    EXPECT_EQ(parse_notation(arm, "41029")->address, 1028);
    EXPECT_EQ(parse_notation(arm, "00010")->address, 9);
    EXPECT_EQ(format_notation(arm, Table::holding_registers, 1028), "401029");
    EXPECT_EQ(kind_of("autonics-arm", "4010290"), NotationError::Kind::malformed);
    EXPECT_EQ(kind_of("autonics-arm", "4129"), NotationError::Kind::malformed);
}

TEST(Notation, FindsTheInputRegistersThatShareTheMemoryOfAnArea) {
    EXPECT_EQ(format_notation(shipped("panasonic-gt"), Table::input_registers, 108), "GDT108");
    EXPECT_EQ(format_notation(shipped("panasonic-gt"), Table::input_registers, 3000), "");
    EXPECT_EQ(format_notation(shipped("autonics-gplp-s"), Table::input_registers, 0), "");
}

TEST(Notation, TellsTheRangeThatANumberIsOutside) {
    EXPECT_EQ(error_of("autonics-gplp-s", "UB40960"),
              "UB40960 is outside UB0 to UB4095F of autonics-gplp-s");
    EXPECT_EQ(error_of("autonics-gplp-s", "UB6047F"),
              "UB6047F is outside UB0 to UB4095F of autonics-gplp-s");
    EXPECT_EQ(error_of("autonics-gplp-s", "UW6048"),
              "UW6048 is outside UW0 to UW6047 of autonics-gplp-s");
    EXPECT_EQ(error_of("autonics-gplp-a", "UW65536"),
              "UW65536 is outside UW0 to UW65535 of autonics-gplp-a");
    EXPECT_EQ(error_of("autonics-arm", "001001"),
              "001001 is outside 000001 to 000064 of autonics-arm");
    EXPECT_EQ(error_of("panasonic-gt", "GDT2048"),
              "GDT2048 is outside GDT0 to GDT2047 and GDT9080 to GDT9086 of panasonic-gt");
    EXPECT_EQ(error_of("panasonic-gt", "GR2560"),
              "GR2560 is outside GR0 to GR255F of panasonic-gt");
    EXPECT_EQ(error_of("omron-cp2e", "W128.00"),
              "W128.00 is outside W0.00 to W127.15 of omron-cp2e");
    EXPECT_EQ(error_of("generic", "465537"), "465537 is outside 400001 to 465536 of generic");
}

TEST(Notation, TellsHowAnAreaIsWritten) {
    EXPECT_EQ(error_of("omron-cp2e", "W5"), "'W5' is not written as W is: W0.00 to W127.15");
    EXPECT_EQ(error_of("omron-cp2e", "W0.16"), "'W0.16' is not written as W is: W0.00 to W127.15");
    EXPECT_EQ(error_of("omron-cp2e", "W0.1"), "'W0.1' is not written as W is: W0.00 to W127.15");
    EXPECT_EQ(error_of("generic", "400000"), "'400000' is not written as 4 is: 400001 to 465536");
    EXPECT_EQ(error_of("generic", "41029"),
              "'41029' is not written as 4 is: 400001 to 465536; write 401029");
    EXPECT_EQ(error_of("autonics-gplp-s", "UW1x"), "'UW1x' is not written as UW is: UW0 to UW6047");
    EXPECT_EQ(kind_of("autonics-gplp-s", "UW99999999999999999999"), NotationError::Kind::malformed);
}

TEST(Notation, TellsWhichNotationsAPanelHas) {
    EXPECT_EQ(error_of("autonics-gplp-s", "D100"),
              "'D100' is no notation of autonics-gplp-s; its notations look like UW0, UB0");
    EXPECT_EQ(error_of("panasonic-gt", ""),
              "'' is no notation of panasonic-gt; its notations look like GR0, GDT0, GDT9080");
    for (const char* text : {"UB", "U", " UB1", "UB-1", "UB+1"})
        EXPECT_EQ(kind_of("autonics-gplp-s", text), NotationError::Kind::unknown) << text;
}

TEST(Notation, TellsWhatToTypeForOtherPeoplesNotations) {
    const auto hint = [](const std::string& profile, const std::string& text) {
        const std::string message = error_of(profile, text);
        return message.substr(std::min(
            message.find(';',
                         message.find("look like") == message.npos ? 0 : message.find("look like")),
            message.size()));
    };
    EXPECT_EQ(hint("generic", "40101"), "; write 400101");
    EXPECT_EQ(hint("autonics-gplp-s", "40101"), "; write UW100");
    EXPECT_EQ(hint("autonics-gplp-s", "400101"), "; write UW100");
    EXPECT_EQ(hint("generic", "4x101"), "; write 400101");
    EXPECT_EQ(hint("generic", "100"),
              "; holding register 100 is 400101 where the first is 0, 400100 where the first is 1");
    EXPECT_EQ(hint("generic", "0"), "; holding register 0 is 400001 where the first is 0");
    EXPECT_EQ(hint("autonics-gplp-s", "100"), "; write UW100 or UB100");
    EXPECT_EQ(hint("panasonic-gt", "100"), "; write GR100 or GDT100");
    EXPECT_EQ(hint("generic", "%MW100"), "; write 400101, where the first is 0");
    EXPECT_EQ(hint("generic", "holding/100"), "; write 400101, where the first is 0");
    EXPECT_EQ(hint("generic", "0x64"),
              "; write 400101 for holding register 100, where the first is 0");
    EXPECT_EQ(hint("panasonic-gt", "GDT 100"), "; write GDT100");
    EXPECT_EQ(hint("generic", "400001-400010"),
              "; write the first, 400001, and how many behind it: count: 10");
    EXPECT_EQ(hint("generic", "400101.3"), "; write 400101, and bit: 3 for one of its bits");
    for (const char* unknown : {"", "x", "70000", "-", "D100"})
        EXPECT_EQ(hint("generic", unknown), "") << unknown;
}

TEST(Notation, TellsWhyNoFunctionReachesWhatAManualLists) {
    EXPECT_EQ(error_of("panasonic-gt", "WGR3"),
              "WGR3: WGR is the word view of GR, and no function reaches it as words; read the 16 "
              "GR bits");
    EXPECT_EQ(error_of("autonics-gp-2005", "ub180"),
              "ub180: the 2005 manual lists UB bits but no function that reaches them; read the UW "
              "word");
    EXPECT_EQ(kind_of("panasonic-gt", "wgr3"), NotationError::Kind::unknown);
}

TEST(Notation, TakesTheSecondAreaOfAPrefixWhenTheFirstDoesNotReachTheItem) {
    const auto clock = parse_notation(shipped("panasonic-gt"), "GDT9085");
    ASSERT_TRUE(clock);
    EXPECT_EQ(clock->area->name, "clock");
    EXPECT_FALSE(clock->area->writable);
    EXPECT_EQ(parse_notation(shipped("panasonic-gt"), "GDT5")->area->name, "GDT");
}

}  // namespace
}  // namespace panelgate::profile::notation_test
