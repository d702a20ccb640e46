#include "panelgate/profile/load_profile.hpp"

#include <gtest/gtest.h>

#include <string>

namespace panelgate::profile::load_profile_test {
namespace {

constexpr const char* kHead =
    "description: a panel\n"
    "manual: its manual\n";
constexpr const char* kFunctions = "functions: [{code: 3}]\n";
constexpr const char* kAreas =
    "areas:\n"
    "  - {name: D, notation: {prefix: D}, table: holding-registers, readable: [0, 99]}\n";

/// Header, functions and areas on lines 1 to 5, then `more` from line 6 on.
std::string whole(const std::string& more = "") {
    return std::string(kHead) + kFunctions + kAreas + more;
}
std::string with_functions(const std::string& functions) {
    return std::string(kHead) + functions + kAreas;
}
/// The areas start on line 5.
std::string with_areas(const std::string& areas) {
    return std::string(kHead) + kFunctions + "areas:\n" + areas;
}

/// Returns the problems; a profile is returned exactly if there are none.
std::string problems_of(const std::string& text) {
    yaml::Problems problems("p.yaml");
    const auto profile = load_profile(text, "p", problems);
    EXPECT_EQ(profile.has_value(), problems.empty());
    return problems.text();
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

TEST(LoadProfile, TakesTheFirstAllowedSettingsWhereNoDefaultIsGiven) {
    const PanelProfile profile = good(whole("serial: {baud: [4800, 9600], parity: [odd]}\n"));
    EXPECT_EQ(to_string(profile.serial.default_format), "4800 8O1");
    EXPECT_EQ(to_string(good(whole()).serial.default_format), "19200 8E1");
}

TEST(LoadProfile, TellsWhatIsMissing) {
    EXPECT_EQ(problems_of("manual: m\n"),
              "p.yaml:1:1: a profile needs 'description'\n"
              "p.yaml:1:1: a profile needs 'functions'\n"
              "p.yaml:1:1: a profile needs 'areas'\n");
    EXPECT_EQ(problems_of(std::string(kHead) + "functions:\nareas: []\n"),
              "p.yaml:3:1: a profile needs 'functions'\n"
              "p.yaml:4:8: areas must not be empty\n");
    EXPECT_EQ(problems_of(with_areas("  - {}\n")),
              "p.yaml:5:5: an area needs 'name'\n"
              "p.yaml:5:5: an area needs 'notation'\n"
              "p.yaml:5:5: an area needs 'table'\n"
              "p.yaml:5:5: an area needs 'readable'\n");
}

TEST(LoadProfile, TellsUnknownKeysWithTheNearestKnownOne) {
    EXPECT_EQ(problems_of(whole("timeing: {}\n")),
              "p.yaml:6:1: unknown key 'timeing' in a profile; did you mean 'timing'?\n");
    EXPECT_EQ(problems_of(with_functions("functions: [{code: 3, brodcast: true}]\n")),
              "p.yaml:3:23: unknown key 'brodcast' in a function; did you mean 'broadcast'?\n");
    EXPECT_EQ(
        problems_of(whole("simulation: {motion: [{area: D, address: 1, speed: 2}]}\n")),
        "p.yaml:6:45: unknown key 'speed' in motion; known keys are area, address, kind, low, "
        "high, period\n");
}

TEST(LoadProfile, HoldsRangesInsideTheAddressSpace) {
    const std::string start = "  - {name: D, notation: {prefix: D}, table: coils, ";
    for (const char* range : {"[0, 65536]", "[5, 4]", "[0]", "[0, 1, 2]", "[-1, 3]", "['0', 3]"}) {
        EXPECT_EQ(problems_of(with_areas(start + "readable: " + range + "}\n")),
                  "p.yaml:5:62: readable must be [FIRST, LAST], two addresses from 0 to 65535\n")
            << range;
    }
    EXPECT_EQ(
        problems_of(with_areas(start + "readable: 5}\n")),
        "p.yaml:5:62: readable must be a list, not '5'; write [5], or '- ' before each item\n");
}

TEST(LoadProfile, HoldsTheWritableRangeInsideTheReadable) {
    EXPECT_EQ(problems_of(with_areas("  - {name: D, notation: {prefix: D}, table: coils,\n"
                                     "     readable: [10, 20],\n"
                                     "     writable: [9, 20]}\n")),
              "p.yaml:7:16: writable must lie inside readable\n");
    EXPECT_EQ(
        problems_of(with_areas("  - {name: D, notation: {prefix: D}, table: input-registers,\n"
                               "     readable: [0, 9], writable: [0, 9]}\n")),
        "p.yaml:5:5: input-registers cannot be written: no writable here\n");
}

TEST(LoadProfile, KnowsTheTables) {
    EXPECT_EQ(
        problems_of(with_areas("  - {name: D, notation: {prefix: D}, table: holding-register,\n"
                               "     also: [registers], readable: [0, 9]}\n")),
        "p.yaml:5:45: table must be coils, discrete-inputs, input-registers or "
        "holding-registers, not 'holding-register'; did you mean 'holding-registers'?\n"
        "p.yaml:6:13: also must list coils discrete-inputs input-registers "
        "holding-registers\n");
    EXPECT_EQ(problems_of(with_areas("  - {name: D, notation: {prefix: D}, table: coils,\n"
                                     "     also: [input-registers], readable: [0, 9]}\n")),
              "p.yaml:5:5: also must list tables of the same kind: bits or words\n");
}

TEST(LoadProfile, WantsEveryAreaAndItemNamedOnce) {
    const std::string area =
        "  - {name: D, notation: {prefix: D}, table: coils, readable: [0, 9]}\n";
    EXPECT_EQ(problems_of(with_areas(area + area)), "p.yaml:6:5: there are two areas 'D'\n");
    EXPECT_EQ(problems_of(with_areas(area + "  - {name: E, notation: {prefix: d}, table: coils, "
                                            "readable: [9, 12]}\n")),
              "p.yaml:6:5: areas 'D' and 'E' share prefix and addresses\n");
    EXPECT_EQ(problems_of(with_areas(area + "  - {name: E, notation: {prefix: D}, table: coils, "
                                            "readable: [10, 12]}\n")),
              "");
}

TEST(LoadProfile, WantsANotationThatCanWriteEveryItem) {
    const auto area = [](const std::string& notation) {
        return with_areas("  - {name: D, table: coils, readable: [0, 99], notation: " + notation +
                          "}\n");
    };
    EXPECT_EQ(problems_of(area("{prefix: 'D/'}")),
              "p.yaml:5:5: prefix must be letters and digits, not 'D/'\n");
    EXPECT_EQ(problems_of(area("{prefix: '4', base: 1, digits: 2}")),
              "p.yaml:5:5: digits are too few for the last item, which needs 3\n");
    EXPECT_EQ(problems_of(area("{prefix: '4', digits: 4, short_digits: 4}")),
              "p.yaml:5:5: short_digits must be fewer than digits\n");
    EXPECT_EQ(problems_of(area("{prefix: B, bit: hex, digits: 4}")),
              "p.yaml:5:75: a notation with a bit part has neither base nor digits\n");
    EXPECT_EQ(problems_of(area("{prefix: B, bit: octal}")),
              "p.yaml:5:75: bit must be none, hex or decimal, not 'octal'\n");
}

TEST(LoadProfile, WantsAViewOfWordsThatAreThere) {
    const auto areas = [](const std::string& last, const std::string& view) {
        return with_areas(
            "  - {name: W, notation: {prefix: W}, table: holding-registers, readable: [1, 2]}\n"
            "  - {name: B, notation: {prefix: B, bit: hex}, table: coils, readable: [16, " +
            last + "], view_of: " + view + "}\n");
    };
    EXPECT_EQ(problems_of(areas("47", "W")), "");
    EXPECT_EQ(problems_of(areas("48", "W")),
              "p.yaml:6:5: readable has bits outside the words of W\n");
    EXPECT_EQ(problems_of(areas("47", "X")),
              "p.yaml:6:5: view_of must name a word area, not 'X'\n");
    EXPECT_EQ(problems_of(areas("47", "B")),
              "p.yaml:6:5: view_of must name a word area, not 'B'\n");
    EXPECT_EQ(
        problems_of(with_areas("  - {name: W, notation: {prefix: W}, table: holding-registers, "
                               "readable: [0, 9], view_of: W}\n")),
        "p.yaml:5:5: only an area of bits can be a view_of words\n");
}

TEST(LoadProfile, KnowsTheFunctionsAndTheirLimits) {
    EXPECT_EQ(problems_of(with_functions("functions: [{code: 9}, {code: 128}]\n")),
              "p.yaml:3:31: code must be a whole number from 1 to 127, not '128'\n");
    EXPECT_EQ(
        problems_of(with_functions("functions: [{code: 9}, {code: 65}, {code: 3, max: 128},\n"
                                   "  {code: 3, broadcast: true}, {code: 6, max: 2}]\n")),
        "p.yaml:3:13: function 9 is neither the standard's nor user-defined (65 to 72, 100 to "
        "110)\n"
        "p.yaml:3:36: max of function 3 can be 127 at most: the byte count is one byte\n"
        "p.yaml:4:3: only functions 5, 6, 15 and 16 can be broadcast, not 3\n"
        "p.yaml:4:3: function 3 is there twice\n"
        "p.yaml:4:31: function 6 has no quantity, so no max\n");
}

TEST(LoadProfile, HoldsTheSerialDefaultAgainstWhatIsAllowed) {
    EXPECT_EQ(problems_of(whole("serial:\n"
                                "  baud: [38400]\n"
                                "  default: {baud: 9600}\n")),
              "p.yaml:7:3: default 9600 8E1 is not among what serial allows\n");
    EXPECT_EQ(problems_of(whole("serial: {baud: [38400, fast], parity: [N], stop_bits: [3]}\n")),
              "p.yaml:6:24: baud must list whole numbers from 50 to 4000000\n"
              "p.yaml:6:40: parity must list none even odd\n"
              "p.yaml:6:56: stop_bits must list whole numbers from 1 to 2\n");
}

TEST(LoadProfile, HoldsStationsAndTimingInTheirRanges) {
    EXPECT_EQ(problems_of(whole("stations: {first: 9, last: 8}\n")),
              "p.yaml:6:28: last must be a whole number from 9 to 247, not '8'\n");
    EXPECT_EQ(problems_of(whole("stations: {first: 0}\n")),
              "p.yaml:6:19: first must be a whole number from 1 to 247, not '0'\n");
    EXPECT_EQ(problems_of(whole("timing: {frame_gap_characters: 1.5}\n")),
              "p.yaml:6:32: frame_gap_characters must be from 3.5 to 1000\n");
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
        "p.yaml:8:14: there is no area 'E'\n"
        "p.yaml:9:26: address lies outside the area D\n"
        "p.yaml:10:38: values must list whole numbers from 0 to 65535\n"
        "p.yaml:11:7: memory needs 'values'\n"
        "p.yaml:12:7: memory needs 'area'\n"
        "p.yaml:14:35: kind must be ramp, sine, toggle or clock, not 'spin'\n"
        "p.yaml:15:34: low and high must be from 0 to 65535, low first\n"
        "p.yaml:16:37: period must be a duration such as 300ms, not '60' (add a unit: us, ms, "
        "s, min)\n");
    const std::string bits =
        "  - {name: B, notation: {prefix: B, bit: hex}, table: coils, readable: [0, 9]}\n"
        "simulation: {memory: [{area: B, address: 0, values: [1, 2]}]}\n";
    EXPECT_EQ(problems_of(with_areas(bits)), "p.yaml:6:53: the values of B are bits: 0 or 1\n");
}

TEST(LoadProfile, IdentifiesPanelsByReadsOnly) {
    const auto ask = [](const std::string& entry) {
        return problems_of(whole("identification: [" + entry + "]\n"));
    };
    EXPECT_EQ(ask("{request: 04 00 00 00 01, reply: 84 01, means: x}"), "");
    EXPECT_NE(ask("{request: 06 00 00 00 01, reply: 06, means: x}")
                  .find("a panel is identified by reads only"),
              std::string::npos);
    EXPECT_NE(ask("{request: read it, reply: 84 01, means: x}")
                  .find("request must be a PDU in pairs of hex digits, not 'read it'"),
              std::string::npos);
    EXPECT_NE(ask("{request: 04 00 00 00 01, means: x}").find("needs 'reply'"), std::string::npos);
}

TEST(LoadProfile, TellsBrokenYamlAndNothingElse) {
    EXPECT_EQ(problems_of("- 1\n"), "p.yaml:1:1: a profile must be a map of keys, not a list\n");
    EXPECT_EQ(problems_of(with_areas("  - D\n")),
              "p.yaml:5:5: an area must be a map of keys, not 'D'\n");
    EXPECT_EQ(problems_of("").substr(0, 11), "p.yaml:1:1:");
}

TEST(LoadProfile, LeavesTheProblemsOfOthersAlone) {
    yaml::Problems problems("p.yaml");
    problems.add({1, 1}, "of somebody else");
    EXPECT_TRUE(load_profile(whole(), "p", problems));
    EXPECT_EQ(problems.list().size(), 1u);
}

}  // namespace
}  // namespace panelgate::profile::load_profile_test
