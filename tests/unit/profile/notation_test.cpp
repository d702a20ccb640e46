#include "panelgate/profile/notation.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstdint>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

#include "panelgate/profile/describe.hpp"
#include "panelgate/profile/load_profile.hpp"

namespace panelgate::profile::notation_test {
namespace {

using modbus::Table;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const Catalogue& catalogue() {
    static const Catalogue shipped = Catalogue::shipped();
    return shipped;
}
const PanelProfile& shipped(std::string_view name) { return *catalogue().find(name); }

std::uint16_t address_of(std::string_view profile, std::string_view text) {
    return parse_notation(shipped(profile), text).value().address;
}
std::string error_of(std::string_view profile, std::string_view text) {
    const auto item = parse_notation(shipped(profile), text);
    return item ? "found " + format_notation(*item->area, item->address) : item.error().message;
}
NotationError::Kind kind_of(std::string_view profile, std::string_view text) {
    return parse_notation(shipped(profile), text).error().kind;
}

TEST(Notation, OfEveryShippedItemIsReadBackAndTheNextOneIsOutOfRange) {
    for (const auto& [name, profile] : catalogue().all()) {
        for (const Area& area : profile.areas) {
            for (std::uint32_t at = area.readable.first; at <= area.readable.last; ++at) {
                const std::string text = format_notation(area, static_cast<std::uint16_t>(at));
                const auto item = parse_notation(profile, text);
                ASSERT_TRUE(item) << name << ' ' << text << ": " << item.error().message;
                ASSERT_EQ(item->area, &area) << name << ' ' << text;
                ASSERT_EQ(item->address, at) << name << ' ' << text;
            }
            if (area.readable.last == 65535) continue;
            const auto next = static_cast<std::uint16_t>(area.readable.last + 1);
            const auto item = parse_notation(profile, format_notation(area, next));
            ASSERT_FALSE(item) << name << ' ' << area.name;
            EXPECT_EQ(item.error().kind, NotationError::Kind::out_of_range) << area.name;
        }
    }
}

struct Row {
    const char* profile;
    Table table;
    const char* items;  ///< notation and address by turns
};
constexpr Row kManuals[] = {
    {"autonics-gplp-s", Table::coils,
     "UB180 288 UB1000 1600 UB1878 3000 UB0 0 UB150 240 UB4095F 65535 UB4094F 65519"},
    {"autonics-gplp-s", Table::holding_registers, "UW0 0 UW100 100 UW15 15 UW6047 6047"},
    {"autonics-gplp-a", Table::coils, "UB810 1296"},
    {"autonics-gplp-a", Table::holding_registers, "UW81 81 UW65535 65535"},
    {"autonics-gp-2005", Table::holding_registers, "UW30 30 UW100 100"},
    {"autonics-arm", Table::coils, "000001 0 000008 7 000010 9"},
    {"autonics-arm", Table::discrete_inputs, "100008 7 100010 9"},
    {"autonics-arm", Table::input_registers, "300001 0 300110 109 301024 1023"},
    {"autonics-arm", Table::holding_registers, "400001 0 400301 300 401029 1028 401030 1029"},
    {"panasonic-gt", Table::coils, "GR20 32 GR173 275 GR12F 207 GR255F 4095"},
    {"panasonic-gt", Table::holding_registers,
     "GDT108 108 GDT510 510 GDT1230 1230 GDT2047 2047 GDT9080 9080 GDT9086 9086"},
    {"omron-cp2e", Table::coils, "W0.00 0 W127.15 2047 W1.04 20 W2.06 38"},
    {"omron-cp2e", Table::holding_registers, "D1000 1000 D4095 4095 D8191 8191 D16383 16383"},
    {"generic", Table::coils, "065536 65535 001001 1000"},
    {"generic", Table::discrete_inputs, "100001 0"},
    {"generic", Table::input_registers, "300001 0"},
    {"generic", Table::holding_registers, "465536 65535"},
};

TEST(Notation, AgreesWithTheArithmeticOfTheManualsBothWays) {
    for (const Row& row : kManuals) {
        const PanelProfile& profile = shipped(row.profile);
        std::istringstream items(row.items);
        std::string notation;
        for (unsigned number = 0; items >> notation >> number;) {
            const auto item = parse_notation(profile, notation);
            ASSERT_TRUE(item) << item.error().message;
            EXPECT_EQ(item->area->table, row.table) << notation;
            EXPECT_EQ(item->address, number) << notation;
            EXPECT_EQ(format_notation(profile, row.table, item->address), notation);
        }
    }
}

TEST(Notation, TakesLeadingZerosAsPaddingAndLettersInAnyCase) {
    for (const char* text : {"UB180", "UB0180", "UB00180", "ub180", "Ub000000180"})
        EXPECT_EQ(address_of("autonics-gplp-s", text), 288) << text;
    EXPECT_EQ(address_of("omron-cp2e", "W001.04"), 20);
    EXPECT_EQ(address_of("panasonic-gt", "gr12f"), 207);
    EXPECT_EQ(address_of("panasonic-gt", "gDt108"), 108);
    EXPECT_EQ(address_of("autonics-gplp-s", "ub4095f"), 65535);
}

TEST(Notation, ReadsTheLastDigitOfABitAsHexAndTheRestAsDecimal) {
    EXPECT_FALSE(parse_notation(shipped("autonics-gplp-s"), "UBF"));
    EXPECT_FALSE(parse_notation(shipped("autonics-gplp-s"), "UB1A0"));
    EXPECT_EQ(address_of("autonics-gplp-s", "UB0F"), 15);
    EXPECT_EQ(address_of("autonics-gplp-s", "UB10"), 16);
    EXPECT_EQ(format_notation(*shipped("autonics-gplp-s").find_area("UB"), 9), "UB9");
    EXPECT_EQ(format_notation(*shipped("autonics-gplp-s").find_area("UB"), 10), "UB0A");
}

TEST(Notation, KnowsTheFiveDigitSpellingOfTheArm) {
    EXPECT_EQ(address_of("autonics-arm", "41029"), 1028);
    EXPECT_EQ(address_of("autonics-arm", "00010"), 9);
    EXPECT_EQ(kind_of("autonics-arm", "4010290"), NotationError::Kind::malformed);
    EXPECT_EQ(kind_of("autonics-arm", "4129"), NotationError::Kind::malformed);
}

TEST(Notation, FindsTheInputRegistersThatShareTheMemoryOfAnArea) {
    EXPECT_EQ(format_notation(shipped("panasonic-gt"), Table::input_registers, 108), "GDT108");
    EXPECT_EQ(format_notation(shipped("panasonic-gt"), Table::input_registers, 3000), "");
    EXPECT_EQ(format_notation(shipped("autonics-gplp-s"), Table::input_registers, 0), "");
}

TEST(Notation, TakesTheSecondAreaOfAPrefixWhenTheFirstDoesNotReachTheItem) {
    const Area& clock = *parse_notation(shipped("panasonic-gt"), "GDT9085").value().area;
    EXPECT_EQ(clock.name, "clock");
    EXPECT_FALSE(clock.writable);
    EXPECT_EQ(parse_notation(shipped("panasonic-gt"), "GDT5")->area->name, "GDT");
}

TEST(NotationError, TellsTheRangeThatANumberIsOutside) {
    const std::pair<const char*, const char*> rows[] = {
        {"autonics-gplp-s", "UB40960 is outside UB0 to UB4095F"},
        {"autonics-gplp-s", "UB6047F is outside UB0 to UB4095F"},
        {"autonics-gplp-s", "UW6048 is outside UW0 to UW6047"},
        {"autonics-gplp-a", "UW65536 is outside UW0 to UW65535"},
        {"autonics-arm", "001001 is outside 000001 to 000064"},
        {"panasonic-gt", "GDT2048 is outside GDT0 to GDT2047 and GDT9080 to GDT9086"},
        {"panasonic-gt", "GR2560 is outside GR0 to GR255F"},
        {"omron-cp2e", "W128.00 is outside W0.00 to W127.15"},
        {"generic", "465537 is outside 400001 to 465536"}};
    for (const auto& [profile, sentence] : rows) {
        const std::string_view text = sentence;
        EXPECT_EQ(error_of(profile, text.substr(0, text.find(' '))),
                  std::string(text) + " of " + profile);
    }
}

TEST(NotationError, TellsHowAnAreaIsWritten) {
    for (const char* text : {"W5", "W0.16", "W0.1"})
        EXPECT_EQ(error_of("omron-cp2e", text),
                  "'" + std::string(text) + "' is not written as W is: W0.00 to W127.15");
    EXPECT_EQ(error_of("generic", "400000"), "'400000' is not written as 4 is: 400001 to 465536");
    EXPECT_EQ(error_of("generic", "41029"),
              "'41029' is not written as 4 is: 400001 to 465536; write 401029");
    EXPECT_EQ(error_of("autonics-gplp-s", "UW1x"), "'UW1x' is not written as UW is: UW0 to UW6047");
    EXPECT_EQ(kind_of("autonics-gplp-s", "UW99999999999999999999"), NotationError::Kind::malformed);
}

TEST(NotationError, TellsWhichNotationsAPanelHasAndWhatNoFunctionReaches) {
    EXPECT_EQ(error_of("autonics-gplp-s", "D100"),
              "'D100' is no notation of autonics-gplp-s; its notations look like UW0, UB0");
    EXPECT_EQ(error_of("panasonic-gt", ""),
              "'' is no notation of panasonic-gt; its notations look like GR0, GDT0, GDT9080");
    for (const char* text : {"UB", "U", " UB1", "UB-1", "UB+1"})
        EXPECT_EQ(kind_of("autonics-gplp-s", text), NotationError::Kind::unknown) << text;
    EXPECT_EQ(error_of("panasonic-gt", "WGR3"),
              "WGR3: WGR is the word view of GR, and no function reaches it as words; read the 16 "
              "GR bits");
    EXPECT_EQ(error_of("autonics-gp-2005", "ub180"),
              "ub180: the 2005 manual lists UB bits but no function that reaches them; read the UW "
              "word");
    EXPECT_EQ(kind_of("panasonic-gt", "wgr3"), NotationError::Kind::unknown);
}

/// What follows the list of a panel's notations; "": nothing.
std::string hint(const std::string& profile, const std::string& text) {
    const std::string message = error_of(profile, text);
    const std::size_t list = message.find("look like");
    const std::size_t end = message.find("; ", list == message.npos ? 0 : list);
    return end == message.npos ? "" : message.substr(end + 2);
}

TEST(NotationError, TellsWhatToTypeForOtherPeoplesNotations) {
    const char* const rows[][3] = {
        {"generic", "40101", "write 400101"},
        {"autonics-gplp-s", "40101", "write UW100"},
        {"autonics-gplp-s", "400101", "write UW100"},
        {"generic", "4x101", "write 400101"},
        {"generic", "100",
         "holding register 100 is 400101 where the first is 0, 400100 where the first is 1"},
        {"generic", "0", "holding register 0 is 400001 where the first is 0"},
        {"autonics-gplp-s", "100", "write UW100 or UB100"},
        {"panasonic-gt", "100", "write GR100 or GDT100"},
        {"generic", "%MW100", "write 400101, where the first is 0"},
        {"generic", "holding/100", "write 400101, where the first is 0"},
        {"generic", "0x64", "write 400101 for holding register 100, where the first is 0"},
        {"panasonic-gt", "GDT 100", "write GDT100"},
        {"generic", "400001-400010", "write the first, 400001, and how many behind it: count: 10"},
        {"generic", "400101.3", "write 400101, and bit: 3 for one of its bits"}};
    for (const auto& [profile, text, expected] : rows)
        EXPECT_EQ(hint(profile, text), expected) << profile << ' ' << text;
    for (const char* unknown : {"", "x", "70000", "-", "D100"})
        EXPECT_EQ(hint("generic", unknown), "") << unknown;
}

/// Returns the text, or the error.
std::string address(std::string_view profile, std::string_view what) {
    const auto text = describe_address(shipped(profile), what);
    return text ? *text : "error: " + text.error().message;
}

TEST(DescribeAddress, TellsTheItemInOtherNotationsItsTablesAndFunctions) {
    EXPECT_EQ(address("autonics-gplp-s", "UB00180"),
              "UB180 -> coil 288 0x0120\n"
              "  is bit 0 of UW18\n"
              "  read by function 1, written by 15\n");
    EXPECT_EQ(address("autonics-gplp-s", "UB14F"),
              "UB14F -> coil 239 0x00EF\n"
              "  is bit 15 of UW14\n"
              "  read by function 1, written by none (read only)\n");
    EXPECT_EQ(address("autonics-gplp-s", "UW18"),
              "UW18 -> holding register 18 0x0012\n"
              "  its bits are UB180 to UB18F\n"
              "  read by function 3, written by 16\n");
    EXPECT_EQ(address("autonics-gplp-s", "UW4096"),
              "UW4096 -> holding register 4096 0x1000\n"
              "  read by function 3, written by 16\n");
    EXPECT_EQ(address("panasonic-gt", "GDT108"),
              "GDT108 -> holding register 108 0x006C\n"
              "  read by function 3, written by 6, 16\n"
              "  also input register 108 0x006C: read by function 4, written by none\n");
    EXPECT_EQ(address("generic", "400001"),
              "400001 -> holding register 0 0x0000\n"
              "  read by function 3, 23, written by 6, 16, 22, 23\n");
    EXPECT_EQ(address("autonics-arm", "100001"),
              "100001 -> discrete input 0 0x0000\n"
              "  read by function 2, written by none (read only)\n");
}

TEST(DescribeAddress, FindsTheNotationOfAWireAddress) {
    const char* const rows[][3] = {
        {"autonics-gplp-s", "coil 288", "coil 288 0x0120 -> UB180"},
        {"autonics-gplp-s", "coils/288", "coil 288 0x0120 -> UB180"},
        {"autonics-gplp-s", "coil/0x120", "coil 288 0x0120 -> UB180"},
        {"autonics-gplp-s", "coils 0X0120", "coil 288 0x0120 -> UB180"},
        {"omron-cp2e", "coils/20", "coil 20 0x0014 -> W1.04"},
        {"autonics-arm", "discrete-inputs/9", "discrete input 9 0x0009 -> 100010"},
        {"autonics-arm", "holding-registers/0x404", "holding register 1028 0x0404 -> 401029"},
        {"panasonic-gt", "input register 108", "input register 108 0x006C -> GDT108"}};
    for (const auto& [profile, what, line] : rows)
        EXPECT_THAT(address(profile, what), StartsWith(std::string(line) + '\n'));
}

TEST(DescribeAddress, TellsWhatThePanelDoesNotHave) {
    const std::pair<const char*, const char*> rows[] = {
        {"input-registers/0", "autonics-gplp-s has no input register 0 0x0000"},
        {"holding register 6048", "autonics-gplp-s has no holding register 6048 0x17A0"},
        {"coils/65536", "'65536' is no address: 0 to 65535, or 0x0 to 0xFFFF"},
        {"coils/x", "'x' is no address: 0 to 65535, or 0x0 to 0xFFFF"},
        {"relays/1",
         "'relays/1' is no notation of autonics-gplp-s; its notations look like UW0, UB0"}};
    for (const auto& [what, error] : rows)
        EXPECT_EQ(address("autonics-gplp-s", what), "error: " + std::string(error));
    EXPECT_THAT(address("panasonic-gt", "WGR3"), StartsWith("error: WGR3: WGR is the word view"));
}

TEST(Describe, ShowsWhatTheManualSays) {
    const std::string text = describe(shipped("panasonic-gt"));
    EXPECT_THAT(text, StartsWith("panasonic-gt: Panasonic GT programmable display\n"
                                 "manual: Panasonic GT MODBUS (RTU mode) Slave, ARCT1F501E-5\n"
                                 "stations: 1 to 247\n"
                                 "serial: baud 9600, 19200, 38400, 57600, 115200; parity none, "
                                 "even, odd; stop bits any  [1.1.2]\n"
                                 "frame gap: 4.0 characters; a pause of 24 bit times inside a "
                                 "request loses it  [1.3, 1.2 (no response)]\n"));
    for (const char* part :
         {"  1   read coils                     up to 2040  [1.3.1]\n",
          "up to 127, broadcast  [1.3.7",
          "  5   write single coil              broadcast  [1.3.4]\n", "read GDT9080 to GDT9086",
          "read only, also input register  [1.1.3]\n", "  WGR      WGR is the word view of GR"})
        EXPECT_THAT(text, HasSubstr(part));
    EXPECT_THAT(describe(shipped("autonics-gplp-s")),
                HasSubstr("write UB150 to UB4095F, bits of UW"));
}

TEST(Describe, HasALineForEveryFunctionAndAreaOfEveryShippedProfile) {
    for (const auto& [name, profile] : catalogue().all()) {
        const std::string text = describe(profile);
        // Description, manual, stations, serial, gap and the headings of functions and areas.
        const auto list = [](std::size_t entries) { return entries == 0 ? 0 : entries + 1; };
        const std::size_t lines = 7 + profile.functions.size() + profile.areas.size() +
                                  profile.unreachable.size() + list(profile.exceptions.size()) +
                                  list(profile.identification.size());
        EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), lines) << text;
    }
}

}  // namespace
}  // namespace panelgate::profile::notation_test
