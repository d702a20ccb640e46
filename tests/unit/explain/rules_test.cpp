// What the rules of `access` mean at each station.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/access/line_rules.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/explain/difference.hpp"
#include "panelgate/modbus/request.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"
#include "support/yaml_text.hpp"

namespace panelgate::explain::rules_test {
namespace {

using namespace config;

struct NoFiles final : Files {
    std::optional<std::string> read(const std::string&) const override { return std::nullopt; }
    std::optional<std::vector<std::string>> list_yaml(const std::string&) const override {
        return std::nullopt;
    }
};

Config loaded(const std::string& rules) {
    yaml::Problems problems("panelgate.yaml");
    auto config = load(R"(
lines:
  - name: floor1
    device: sim
    serial: {baud: 38400, parity: none}
    stations:
      - {id: 31, name: press, profile: autonics-gplp-s}
      - {id: 20, name: oven, profile: panasonic-gt}
modbus_tcp: [{listen: "127.0.0.1:502"}]
access:
  rules:
)" + rules,
                       NoFiles(), problems);
    EXPECT_TRUE(config) << problems.text();
    return config.value_or(Config{});
}

/// The name of the rule that denies; "" if the request is allowed.
std::string denied(const Config& config, std::uint8_t station, const Bytes& pdu) {
    const WhoRef who = make_who({.face = Face::modbus_tcp, .standing = Role::operator_});
    const auto verdict = config.lines[0].access.rules->judge(who, station, test::request_of(pdu));
    return verdict.allowed ? "" : std::string(verdict.rule_name());
}

TEST(Rules, ADeniedRangeIsTheMemoryHoweverItIsShown) {
    const Config config = loaded("    - {name: no, deny: [write], range: UW102}\n");
    EXPECT_EQ(denied(config, 31, "10 0066 0001 02 0001"_hex), "no");
    EXPECT_EQ(denied(config, 31, "10 0065 0001 02 0001"_hex), "");
    EXPECT_EQ(denied(config, 31, "0F 0660 0001 01 01"_hex), "no") << "UB1020 is its bit";
    EXPECT_EQ(denied(config, 31, "0F 066F 0001 01 01"_hex), "no") << "and UB102F";
    EXPECT_EQ(denied(config, 31, "0F 0670 0001 01 01"_hex), "");
    EXPECT_EQ(denied(config, 20, "10 0066 0001 02 0001"_hex), "") << "the oven has no UW";
    const Config bit = loaded("    - {name: no, deny: [write], range: UB1023}\n");
    EXPECT_EQ(denied(bit, 31, "0F 0662 0001 01 01"_hex), "") << "UB1022 is another bit";
    EXPECT_EQ(denied(bit, 31, "10 0066 0001 02 0001"_hex), "no") << "the word has that bit";
}

TEST(Rules, AnAllowedRangeIsNoMoreThanItNames) {
    const std::string others = "    - {name: others, deny: [write]}\n";
    const Config bit = loaded("    - {name: yes, allow: [write], range: UB1023}\n" + others);
    EXPECT_EQ(denied(bit, 31, "0F 0663 0001 01 01"_hex), "");
    EXPECT_EQ(denied(bit, 31, "10 0066 0001 02 0001"_hex), "others") << "15 bits more";
    const Config words =
        loaded("    - {name: yes, allow: [write], range: UB1020-UB103F}\n" + others);
    EXPECT_EQ(denied(words, 31, "10 0066 0002 04 0001 0001"_hex), "") << "these words, whole";
    EXPECT_EQ(denied(words, 31, "10 0066 0003 06 0001 0001 0001"_hex), "others");
    const Config word = loaded("    - {name: yes, allow: [write], range: UW102}\n" + others);
    EXPECT_EQ(denied(word, 31, "0F 0660 0010 02 FFFF"_hex), "") << "its bits";
    EXPECT_EQ(denied(word, 31, "0F 0660 0011 03 FFFFFF"_hex), "others");
}

TEST(Rules, ARangeOfATableIsAlsoOneOfStationsThatAreNotListed) {
    const Config config =
        loaded("    - {name: no, deny: [write], range: holding-registers/100-109}\n");
    EXPECT_EQ(denied(config, 9, "06 006D 0001"_hex), "no");
    EXPECT_EQ(denied(config, 9, "06 006E 0001"_hex), "");
    EXPECT_EQ(denied(config, 20, "06 0064 0001"_hex), "no");
}

TEST(Rules, WhoeverTakesThemAwayOrAllowsMoreProtectsLess) {
    const std::string no = "    - {name: no, deny: [write]}\n";
    const std::string yes = "    - {name: yes, allow: [write], stations: [press]}\n";
    const auto told = [](const std::string& before, const std::string& now) {
        std::string text;
        for (const std::string& one : weaker(loaded(before), loaded(now))) text += one + '\n';
        return text;
    };
    EXPECT_EQ(told(no, no), "");
    EXPECT_EQ(told("\n" + no, no), "") << "in another line of its file";
    EXPECT_EQ(told(no, no + "    - {name: more, deny: [read]}\n"), "");
    EXPECT_EQ(told(no, "    - {name: other, deny: [read]}\n"), "access/rules/no: removed\n");
    EXPECT_EQ(told(no, yes + no), "access/rules/yes: added\n");
    EXPECT_EQ(told(no + yes, yes + no), "access: rules no, yes -> yes, no\n");
    EXPECT_EQ(told(no, "    - {name: no, deny: [write], stations: [press]}\n"),
              "access/rules/no: stations not set -> [floor1/31]\n");
}

}  // namespace
}  // namespace panelgate::explain::rules_test
