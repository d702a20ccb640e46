#include "panelgate/profile/load_profile.hpp"

#include <gmock/gmock.h>

#include <string>
#include <string_view>
#include <vector>

namespace panelgate::profile::load_profile_test {
namespace {

using ::testing::HasSubstr;

const std::string kHead = "description: a panel\nmanual: its manual\n";
const std::string kFunctions = "functions: [{code: 3}]\n";

/// Functions on line 3, areas from line 5 on.
std::string with_functions(const std::string& functions) {
    return kHead + functions +
           "areas:\n"
           "  - {name: D, notation: {prefix: D}, table: holding-registers, readable: [0, 99]}\n";
}
std::string with_areas(const std::string& areas) { return kHead + kFunctions + "areas:\n" + areas; }
/// `keys` from column 38 of line 5 on.
std::string with_area(const std::string& keys) {
    return with_areas("  - {name: D, notation: {prefix: D}, " + keys + "}\n");
}
/// `more` from line 6 on.
std::string whole(const std::string& more = "") { return with_functions(kFunctions) + more; }

/// Returns the problems without the file's name, one a line; a profile is returned exactly if there
/// are none.
std::string problems_of(const std::string& text) {
    constexpr std::string_view kFile = "p.yaml:";
    yaml::Problems problems("p.yaml");
    const auto profile = load_profile(text, "p", problems);
    EXPECT_EQ(profile.has_value(), problems.empty());
    std::string told = problems.text();
    EXPECT_TRUE(told.empty() || told.starts_with(kFile));
    for (std::size_t at = 0; (at = told.find(kFile, at)) != std::string::npos;)
        told.erase(at, kFile.size());
    if (!told.empty()) told.pop_back();
    return told;
}

PanelProfile good(const std::string& text) {
    yaml::Problems problems("p.yaml");
    auto profile = load_profile(text, "p", problems);
    EXPECT_EQ(problems.text(), "");
    return profile.value_or(PanelProfile());
}

TEST(LoadProfile, NeedsLittle) {
    const PanelProfile profile = good(whole());
    EXPECT_EQ(profile.name, "p");
    EXPECT_EQ(profile.first_station, 1);
    EXPECT_EQ(profile.last_station, 247);
    EXPECT_EQ(profile.max_count(3), 125u);
    EXPECT_EQ(profile.timing.frame_gap_characters, 3.5);
    EXPECT_EQ(profile.simulation.protected_exception, 3);
    EXPECT_FALSE(profile.areas.at(0).writable);
    EXPECT_EQ(to_string(profile.serial.default_format), "19200 8E1");
    const PanelProfile fixed = good(whole("serial: {baud: [4800, 9600], parity: [odd]}\n"));
    EXPECT_EQ(to_string(fixed.serial.default_format), "4800 8O1") << "the first allowed";
}

TEST(LoadProfile, ReadsEveryKey) {
    const PanelProfile profile = good(
        "description: d\n"
        "manual: m\n"
        "stations: {first: 2, last: 31, source: s1}\n"
        "serial: {baud: [9600, 38400], parity: [odd, none], stop_bits: [1, 2],\n"
        "         default: {baud: 38400, parity: none, stop_bits: 2}, source: s2}\n"
        "functions: [{code: 15, max: 2040, broadcast: true, source: s3}]\n"
        "areas:\n"
        "  - {name: W, notation: {prefix: W, bit: none, base: 1, digits: 5, short_digits: 4},\n"
        "     table: holding-registers, also: [input-registers], readable: [1, 99],\n"
        "     writable: [2, 98], description: words, source: s4}\n"
        "  - {name: B, notation: {prefix: B, bit: decimal}, table: coils, readable: [16, 99],\n"
        "     view_of: W}\n"
        "timing: {frame_gap_characters: 4, max_gap_bits: 24, source: s5}\n"
        "exceptions: [{code: 3, meaning: no}]\n"
        "unreachable: [{prefix: X, reason: because}]\n"
        "simulation:\n"
        "  protected_exception: 2\n"
        "  memory: [{area: W, address: 3, values: [7, 8]}]\n"
        "  motion: [{area: W, address: 9, kind: sine, low: 1, high: 2, period: 5s}]\n");
    EXPECT_EQ(profile.first_station, 2);
    EXPECT_EQ(profile.serial.baud, (std::vector<int>{9600, 38400}));
    EXPECT_EQ(profile.serial.parity, (std::vector<Parity>{Parity::odd, Parity::none}));
    EXPECT_EQ(to_string(profile.serial.default_format), "38400 8N2");
    EXPECT_TRUE(profile.find_function(15)->broadcast);
    EXPECT_EQ(profile.max_count(15), 2040u);
    const Area& words = profile.areas.at(0);
    EXPECT_EQ(words.notation.short_digits, 4u);
    EXPECT_EQ(words.also.at(0), modbus::Table::input_registers);
    EXPECT_EQ(words.writable->last, 98u);
    EXPECT_EQ(words.source, "s4");
    EXPECT_EQ(profile.areas.at(1).view_of, "W");
    EXPECT_EQ(profile.timing.max_gap_bits, 24u);
    EXPECT_EQ(profile.exceptions.at(0).meaning, "no");
    EXPECT_EQ(profile.unreachable.at(0).reason, "because");
    EXPECT_EQ(profile.simulation.protected_exception, 2);
    EXPECT_EQ(profile.simulation.memory.at(0).values.at(1), 8);
    EXPECT_EQ(profile.simulation.motion.at(0).period, Duration(5s));
}

TEST(LoadProfile, TellsWhatIsMissing) {
    EXPECT_EQ(problems_of("manual: m\n"),
              "1:1: a profile needs 'description'\n"
              "1:1: a profile needs 'functions'\n"
              "1:1: a profile needs 'areas'");
    EXPECT_EQ(problems_of(kHead + "functions:\nareas: []\n"),
              "3:1: a profile needs 'functions'\n"
              "4:8: areas must not be empty");
    EXPECT_EQ(problems_of(with_areas("  - {}\n")),
              "5:5: an area needs 'name'\n"
              "5:5: an area needs 'notation'\n"
              "5:5: an area needs 'table'\n"
              "5:5: an area needs 'readable'");
}

TEST(LoadProfile, TellsUnknownKeysWithTheNearestKnownOne) {
    EXPECT_EQ(problems_of(whole("timeing: {}\n")),
              "6:1: unknown key 'timeing' in a profile; did you mean 'timing'?");
    EXPECT_EQ(problems_of(with_functions("functions: [{code: 3, brodcast: true}]\n")),
              "3:23: unknown key 'brodcast' in a function; did you mean 'broadcast'?");
    EXPECT_EQ(problems_of(whole("simulation: {motion: [{area: D, address: 1, speed: 2}]}\n")),
              "6:45: unknown key 'speed' in motion; known keys are area, address, kind, low, high, "
              "period");
}

TEST(LoadProfile, HoldsRangesInsideTheAddressSpaceAndTheWritableInsideTheReadable) {
    for (const std::string range :
         {"[0, 65536]", "[5, 4]", "[0]", "[0, 1, 2]", "[-1, 3]", "['0', 3]"})
        EXPECT_EQ(problems_of(with_area("table: coils, readable: " + range)),
                  "5:62: readable must be [FIRST, LAST], two addresses from 0 to 65535")
            << range;
    EXPECT_EQ(problems_of(with_area("table: coils, readable: 5")),
              "5:62: readable must be a list such as [0, 119], not '5'");
    EXPECT_EQ(problems_of(with_area("table: coils, readable: 0-99")),
              "5:62: readable must be a list such as [0, 119], not '0-99'");
    EXPECT_EQ(problems_of(with_area("table: coils,\n"
                                    "     readable: [10, 20],\n"
                                    "     writable: [9, 20]")),
              "7:16: writable must lie inside readable");
    EXPECT_EQ(problems_of(with_area("table: input-registers, readable: [0, 9], writable: [0, 9]")),
              "5:5: input-registers cannot be written: no writable here");
}

TEST(LoadProfile, KnowsTheTables) {
    EXPECT_EQ(problems_of(with_area("table: holding-register,\n"
                                    "     also: [registers], readable: [0, 9]")),
              "5:45: table must be coils, discrete-inputs, input-registers or holding-registers, "
              "not 'holding-register'; did you mean 'holding-registers'?\n"
              "6:13: also must list coils discrete-inputs input-registers holding-registers");
    EXPECT_EQ(problems_of(with_area("table: coils, also: [input-registers], readable: [0, 9]")),
              "5:5: also must list tables of the same kind: bits or words");
}

TEST(LoadProfile, WantsEveryAreaAndItemNamedOnce) {
    const auto areas = [](const std::string& second) {
        return with_area("table: coils, readable: [0, 9]") + "  - {" + second + "}\n";
    };
    EXPECT_EQ(problems_of(areas("name: D, notation: {prefix: D}, table: coils, readable: [0, 9]")),
              "6:5: there are two areas 'D'");
    EXPECT_EQ(problems_of(areas("name: E, notation: {prefix: d}, table: coils, readable: [9, 12]")),
              "6:5: areas 'D' and 'E' share prefix and addresses");
    EXPECT_EQ(
        problems_of(areas("name: E, notation: {prefix: D}, table: coils, readable: [10, 12]")), "");
}

TEST(LoadProfile, WantsANotationThatCanWriteEveryItem) {
    const char* const rows[][2] = {
        {"{prefix: 'D/'}", "5:5: prefix must be letters and digits, not 'D/'"},
        {"{prefix: '4', base: 1, digits: 2}",
         "5:5: digits are too few for the last item, which needs 3"},
        {"{prefix: '4', digits: 4, short_digits: 4}",
         "5:5: short_digits must be fewer than digits"},
        {"{prefix: B, bit: hex, digits: 4}",
         "5:75: a notation with a bit part has neither base nor digits"},
        {"{prefix: B, bit: octal}", "5:75: bit must be none, hex or decimal, not 'octal'"}};
    for (const auto& [notation, problem] : rows)
        EXPECT_EQ(
            problems_of(with_areas("  - {name: D, table: coils, readable: [0, 99], notation: " +
                                   std::string(notation) + "}\n")),
            problem);
}

TEST(LoadProfile, WantsAViewOfWordsThatAreThere) {
    const auto areas = [](const std::string& last, const std::string& view) {
        return with_areas(
            "  - {name: W, notation: {prefix: W}, table: holding-registers, readable: [1, 2]}\n"
            "  - {name: B, notation: {prefix: B, bit: hex}, table: coils, readable: [16, " +
            last + "], view_of: " + view + "}\n");
    };
    EXPECT_EQ(problems_of(areas("47", "W")), "");
    EXPECT_EQ(problems_of(areas("48", "W")), "6:5: readable has bits outside the words of W");
    EXPECT_EQ(problems_of(areas("47", "X")), "6:5: view_of must name a word area, not 'X'");
    EXPECT_EQ(problems_of(areas("47", "B")), "6:5: view_of must name a word area, not 'B'");
    EXPECT_EQ(problems_of(with_area("table: holding-registers, readable: [0, 9], view_of: D")),
              "5:5: only an area of bits can be a view_of words");
}

TEST(LoadProfile, KnowsTheFunctionsAndTheirLimits) {
    EXPECT_EQ(problems_of(with_functions("functions: [{code: 9}, {code: 128}]\n")),
              "3:31: code must be a whole number from 1 to 127, not '128'");
    EXPECT_EQ(problems_of(with_functions("functions: [{code: 9}, {code: 65}, {code: 3, max: 128},\n"
                                         "  {code: 3, broadcast: true}, {code: 6, max: 2}]\n")),
              "3:13: function 9 is neither the standard's nor user-defined (65 to 72, 100 to 110)\n"
              "3:36: max of function 3 can be 127 at most: the byte count is one byte\n"
              "4:3: only functions 5, 6, 15 and 16 can be broadcast, not 3\n"
              "4:3: function 3 is there twice\n"
              "4:31: function 6 has no quantity, so no max");
}

TEST(LoadProfile, HoldsSerialStationsAndTimingInTheirRanges) {
    const char* const rows[][2] = {
        {"serial:\n  baud: [38400]\n  default: {baud: 9600}\n",
         "7:3: default 9600 8E1 is not among what serial allows"},
        {"serial: {baud: [38400, fast], parity: [N], stop_bits: [3]}\n",
         "6:24: baud must list whole numbers from 50 to 4000000\n"
         "6:40: parity must list none even odd\n"
         "6:56: stop_bits must list whole numbers from 1 to 2"},
        {"stations: {first: 9, last: 8}\n",
         "6:28: last must be a whole number from 9 to 255, not '8'"},
        {"stations: {first: 0}\n", "6:19: first must be a whole number from 1 to 255, not '0'"},
        {"timing: {frame_gap_characters: 1.5}\n",
         "6:32: frame_gap_characters must be from 3.5 to 1000"}};
    for (const auto& [more, problems] : rows) EXPECT_EQ(problems_of(whole(more)), problems);
}

TEST(LoadProfile, WantsSimulatedCellsThatThePanelHas) {
    EXPECT_EQ(
        problems_of(whole("simulation:\n"
                          "  memory:\n"
                          "    - {area: E, address: 0, values: [1]}\n"
                          "    - {area: D, address: 99, values: [1, 2]}\n"
                          "    - {area: D, address: 0, values: [65536]}\n"
                          "    - {area: D, address: 0}\n"
                          "    - {address: 0, values: [1]}\n"
                          "  motion:\n"
                          "    - {area: D, address: 0, kind: spin}\n"
                          "    - {area: D, address: 0, low: 300}\n"
                          "    - {area: D, address: 0, period: 60}\n")),
        "8:14: there is no area 'E'\n"
        "9:26: address lies outside the area D\n"
        "10:38: values must list whole numbers from 0 to 65535\n"
        "11:7: memory needs 'values'\n"
        "12:7: memory needs 'area'\n"
        "14:35: kind must be ramp, sine, toggle or clock, not 'spin'\n"
        "15:34: low and high must be from 0 to 65535, low first\n"
        "16:37: period must be a duration such as 300ms, not '60' (add a unit: us, ms, s, min)");
    EXPECT_EQ(problems_of(with_area("table: coils, readable: [0, 9]") +
                          "simulation: {memory: [{area: D, address: 0, values: [1, 2]}]}\n"),
              "6:53: the values of D are bits: 0 or 1");
}

TEST(LoadProfile, IdentifiesPanelsByReadsOnly) {
    const auto ask = [](const std::string& entry) {
        return problems_of(whole("identification: [{" + entry + ", means: x}]\n"));
    };
    EXPECT_EQ(ask("request: 04 00 00 00 01, reply: 84 01"), "");
    EXPECT_THAT(ask("request: 06 00 00 00 01, reply: 06"),
                HasSubstr("a panel is identified by reads only"));
    EXPECT_THAT(ask("request: read it, reply: 84 01"),
                HasSubstr("request must be a PDU in pairs of hex digits, not 'read it'"));
    EXPECT_THAT(ask("request: 04 00 00 00 01"), HasSubstr("needs 'reply'"));
}

TEST(LoadProfile, TellsBrokenYamlAndNothingElse) {
    EXPECT_EQ(problems_of("- 1\n"), "1:1: a profile must be a map of keys, not a list");
    EXPECT_EQ(problems_of(with_areas("  - D\n")), "5:5: an area must be a map of keys, not 'D'");
    EXPECT_EQ(problems_of("").substr(0, 4), "1:1:");
}

TEST(LoadProfile, LeavesTheProblemsOfOthersAlone) {
    yaml::Problems problems("p.yaml");
    problems.add({1, 1}, "of somebody else");
    EXPECT_TRUE(load_profile(whole(), "p", problems));
    EXPECT_EQ(problems.list().size(), 1u);
}

}  // namespace
}  // namespace panelgate::profile::load_profile_test
