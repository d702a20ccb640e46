#include "panelgate/access/line_rules.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::access::line_rules_test {
namespace {

using modbus::Span;
using modbus::Table;

const WhoRef kScada = make_who({.face = Face::modbus_tcp,
                                .name = "modbus_tcp 10.0.0.7:5000",
                                .address = "10.0.0.7",
                                .listener = "0.0.0.0:502",
                                .standing = Role::operator_});
const WhoRef kBoss =
    make_who({.face = Face::http, .address = "fd00::7", .token = "boss", .standing = Role::admin});

/// 100 to 199 of oven 20 may be written from 10.0.0.0/24, nothing else by operators.
Settings contract() {
    Settings settings;
    Rule setpoints{.name = "oven-setpoints", .allow = true, .acts = {Act::read, Act::write}};
    setpoints.from = {{"10.0.0.0", 24}};
    setpoints.stations = {{"floor1", 20}};
    setpoints.range = "GDT100-GDT199";
    setpoints.items[{"floor1", 20}] = {{Table::holding_registers, 100, 100}};
    Rule others{.name = "no-other-writes", .acts = {Act::write, Act::broadcast, Act::raw}};
    others.roles = {"viewer", "operator"};
    settings.rules = {setpoints, others};
    return settings;
}

/// The name of the rule that refuses, or "".
std::string refused(const Settings& settings, const WhoRef& who, std::uint8_t station,
                    const Bytes& pdu, bool raw = false) {
    const LineRules rules(std::make_shared<const Settings>(settings), "floor1", {5, 20});
    const auto request = test::request_of(pdu);
    const Verdict verdict = rules.judge(who, {.station = station, .asked = &request, .raw = raw});
    return verdict.allowed ? "" : std::string(verdict.rule_name());
}

TEST(LineRules, WhatAnOwnRoleLacksIsRefusedUnderItsName) {
    OwnRole setter{.name = "setter"};
    setter.rights.add(Right::read);
    setter.rights.add(Right::write);
    const WhoRef who = make_who({.standing = {Role::operator_, setter}});
    Settings settings;
    settings.roles = {setter};
    EXPECT_EQ(refused(settings, who, 20, "06 0064 0001"_hex), "");
    EXPECT_EQ(refused(settings, who, 0, "06 0064 0001"_hex), "setter") << "no broadcasts";
    EXPECT_EQ(refused(settings, who, 20, "03 0064 0001"_hex, true), "setter") << "nothing raw";
    EXPECT_EQ(refused(contract(), who, 20, "06 0000 0001"_hex), "") << "it is no operator";
    const LineRules rules(std::make_shared<const Settings>(settings), "floor1", {5, 20});
    EXPECT_EQ(rules.denying_names(), std::vector<std::string>{"setter"});
    OwnRole blind{.name = "blind"};
    blind.rights.add(Right::write);
    const WhoRef writer = make_who({.standing = {Role::operator_, blind}});
    EXPECT_FALSE(rules.may_some(writer, 20, Act::read));
    EXPECT_FALSE(rules.may_read_some(writer));
    EXPECT_EQ(refused(settings, writer, 20, "17 0000 0001 0064 0001 02 0001"_hex), "blind");
}

/// Neighbours share what was decided for the one before only where the same rule decides.
TEST(LineRules, WhatWasAskedBeforeChangesNothing) {
    const auto settings = std::make_shared<const Settings>(contract());
    const LineRules asked_often(settings, "floor1", {5, 20});
    const auto may = [](const LineRules& rules, const Span& items) {
        return rules.judge(kScada, 20, Act::write, 0x10, items).allowed;
    };
    for (std::uint32_t n = 0; n < 4000; ++n) {
        const Span items{Table::holding_registers, 90 + n * 37 % 120, 1 + n % 5};
        const LineRules asked_once(settings, "floor1", {5, 20});
        EXPECT_EQ(may(asked_often, items), may(asked_once, items)) << items.first << " " << n % 5;
        EXPECT_EQ(may(asked_often, items), items.first >= 100 && items.end() <= 200);
    }
    EXPECT_FALSE(may(asked_often, {Table::holding_registers, 0, 1}));
    EXPECT_FALSE(may(asked_often, {Table::holding_registers, 65535, 1}));
}

TEST(LineRules, WithoutRulesEverybodyMayDoEverything) {
    EXPECT_EQ(refused({}, kScada, 20, "06 0064 0001"_hex), "");
    EXPECT_EQ(refused({}, nullptr, 0, "06 0064 0001"_hex, true), "");
    EXPECT_TRUE(LineRules().is_open());
    Settings closed;
    closed.allow_by_default = false;
    EXPECT_EQ(refused(closed, kScada, 20, "03 0064 0001"_hex), "default");
    EXPECT_EQ(refused(closed, nullptr, 20, "03 0064 0001"_hex), "default");
    EXPECT_EQ(refused(closed, own_task("poll of oven"), 20, "03 0064 0001"_hex), "")
        << "what is configured is allowed";
}

TEST(LineRules, TheFirstRuleThatMatchesAnItemDecidesAndOneDeniedItemIsEnough) {
    const Settings settings = contract();
    EXPECT_EQ(refused(settings, kScada, 20, "06 0064 0001"_hex), "") << "the first";
    EXPECT_EQ(refused(settings, kScada, 20, "06 00C7 0001"_hex), "") << "the last";
    EXPECT_EQ(refused(settings, kScada, 20, "06 0063 0001"_hex), "no-other-writes");
    EXPECT_EQ(refused(settings, kScada, 20, "06 00C8 0001"_hex), "no-other-writes");
    EXPECT_EQ(refused(settings, kScada, 20, "10 00C7 0002 04 0001 0002"_hex), "no-other-writes")
        << "its second item";
    EXPECT_EQ(refused(settings, kScada, 20, "05 0064 FF00"_hex), "no-other-writes")
        << "another table";
    EXPECT_EQ(refused(settings, kScada, 5, "06 0064 0001"_hex), "no-other-writes");
    EXPECT_EQ(refused(settings, kScada, 5, "03 0064 0001"_hex), "") << "reads are nobody's";
    EXPECT_EQ(refused(settings, kBoss, 5, "06 0064 0001"_hex), "") << "no rule is about it";
}

TEST(LineRules, BothSpansOf17hAreJudged) {
    Settings settings = contract();
    settings.rules[1].acts = {Act::read, Act::write};
    const auto both = [&](const Bytes& pdu) { return refused(settings, kScada, 20, pdu); };
    EXPECT_EQ(both("17 0064 0001 0065 0001 02 0001"_hex), "");
    EXPECT_EQ(both("17 0063 0001 0065 0001 02 0001"_hex), "no-other-writes") << "reads outside";
    EXPECT_EQ(both("17 0064 0001 0063 0001 02 0001"_hex), "no-other-writes") << "writes outside";
}

TEST(LineRules, AFunctionWithoutItemsIsOnlyARangesWhereItIsNamed) {
    Settings settings;
    Rule range{.name = "range", .acts = {Act::read, Act::write}};
    range.range = "0-99";
    range.unlisted_items = Span{Table::holding_registers, 0, 100};
    settings.rules = {range};
    for (const Bytes& pdu : {"14 07 06 0004 0001 0002"_hex, "18 0000"_hex, "2B 0E 01 00"_hex,
                             "41 01"_hex, "15 09 06 0004 0007 0001 06AF"_hex})
        EXPECT_EQ(refused(settings, kScada, 20, pdu), "") << int{pdu[0]};
    settings.rules[0].functions = {0x14, 0x15, 0x18, 0x2B, 0x41};
    for (const Bytes& pdu : {"14 07 06 0004 0001 0002"_hex, "18 0000"_hex, "2B 0E 01 00"_hex,
                             "41 01"_hex, "15 09 06 0004 0007 0001 06AF"_hex})
        EXPECT_EQ(refused(settings, kScada, 20, pdu), "range") << int{pdu[0]};
    EXPECT_EQ(refused(settings, kScada, 20, "03 0000 0001"_hex), "") << "03 is not named";
}

TEST(LineRules, ABroadcastWritesToEveryListedStation) {
    Settings settings;
    Rule oven{.name = "oven", .acts = {Act::write}};
    oven.stations = {{"floor1", 20}};
    settings.rules = {oven};
    EXPECT_EQ(refused(settings, kScada, 0, "06 0064 0001"_hex), "oven");
    settings.rules[0].acts = {Act::broadcast};
    EXPECT_EQ(refused(settings, kScada, 0, "06 0064 0001"_hex), "oven");
    EXPECT_EQ(refused(settings, kScada, 20, "06 0064 0001"_hex), "");
    settings.rules[0].stations = {{"floor2", 20}};
    EXPECT_EQ(refused(settings, kScada, 0, "06 0064 0001"_hex), "") << "another line";
}

TEST(LineRules, ABroadcastWritesToAStationThatOnlyARuleKnows) {
    Settings settings;
    settings.rules = {{.name = "far", .acts = {Act::write}, .stations = {{"floor1", 44}}}};
    EXPECT_EQ(refused(settings, kScada, 0, "06 0064 0001"_hex), "far");
    settings.rules[0].tokens = {"ops"};
    EXPECT_EQ(refused(settings, kScada, 0, "06 0064 0001"_hex), "") << "about somebody else";
    settings.rules = {{.name = "far", .acts = {Act::write}, .stations = {{"floor2", 44}}}};
    EXPECT_EQ(refused(settings, kScada, 0, "06 0064 0001"_hex), "") << "another line";
}

TEST(LineRules, AFunctionThatOnlyItsVendorKnowsReadsAndWrites) {
    for (const Act act : {Act::read, Act::write}) {
        const Settings settings{.rules = {{.name = "no", .acts = {act}}}};
        EXPECT_EQ(refused(settings, kScada, 20, "41 01"_hex), "no");
        EXPECT_EQ(refused(settings, kScada, 20, "41 01"_hex, true), "no") << "raw, too";
    }
    const Settings blind{.rules = {{.name = "blind", .acts = {Act::read}}}};
    EXPECT_EQ(refused(blind, kScada, 20, "08 0000 1234"_hex), "") << "08 tells nothing of a panel";
}

TEST(LineRules, ARawRequestIsAlsoWhatItDoes) {
    Settings settings;
    settings.rules = {{.name = "no-writes", .acts = {Act::write}}};
    EXPECT_EQ(refused(settings, kScada, 20, "06 0064 0001"_hex, true), "no-writes");
    EXPECT_EQ(refused(settings, kScada, 20, "03 0064 0001"_hex, true), "");
    settings.rules = {{.name = "no-raw", .acts = {Act::raw}}};
    EXPECT_EQ(refused(settings, kScada, 20, "03 0064 0001"_hex, true), "no-raw");
    EXPECT_EQ(refused(settings, kScada, 20, "06 0064 0001"_hex), "");
}

TEST(LineRules, ATranslatedRequestIsJudgedAsAskedAndAsSent) {
    Settings settings;
    Rule words{.name = "words", .acts = {Act::read}};
    words.range = "0-99";
    words.unlisted_items = Span{Table::holding_registers, 0, 100};
    settings.rules = {words};
    const LineRules rules(std::make_shared<const Settings>(settings), "floor1", {20});
    const auto asked = test::request_of("04 0000 0001"_hex);
    const auto sent = test::request_of("03 0000 0001"_hex);
    EXPECT_TRUE(rules.judge(kScada, 20, asked).allowed);
    EXPECT_FALSE(rules.judge(kScada, {.station = 20, .asked = &asked, .sent = &sent}).allowed);
    EXPECT_FALSE(rules.judge(kScada, {.station = 20, .asked = &sent, .sent = &asked}).allowed);
}

TEST(LineRules, KnowsWhoSeesAStation) {
    Settings settings = contract();
    const auto rules = [&] {
        return LineRules(std::make_shared<const Settings>(settings), "floor1", {5, 20});
    };
    EXPECT_TRUE(rules().may_all(kScada, 5, Act::read));
    EXPECT_FALSE(rules().may_some(kScada, 5, Act::write));
    EXPECT_TRUE(rules().may_some(kScada, 20, Act::write));
    settings.allow_by_default = false;
    EXPECT_FALSE(rules().may_some(kScada, 5, Act::read));
    EXPECT_TRUE(rules().may_some(kScada, 20, Act::read)) << "a part of it";
    EXPECT_FALSE(rules().may_all(kScada, 20, Act::read));
    EXPECT_FALSE(rules().may_some(kBoss, 20, Act::read));
    EXPECT_TRUE(rules().may_all(own_task("poll of oven"), 20, Act::read));
}

TEST(LineRules, ConditionsOnWhoAsks) {
    struct Row {
        const char* what;
        Rule rule;
        bool scada;
        bool boss;
    };
    Rule empty{.name = "r", .acts = {Act::read}};
    std::vector<Row> rows;
    const auto row = [&](const char* what, bool scada, bool boss, auto set) {
        Rule rule = empty;
        set(rule);
        rows.push_back({what, rule, scada, boss});
    };
    row("nothing", true, true, [](Rule&) {});
    row("v4", true, false, [](Rule& rule) { rule.from = {{"10.0.0.0", 8}}; });
    row("v6", false, true, [](Rule& rule) { rule.from = {{"fd00::", 16}}; });
    row("any", true, true, [](Rule& rule) { rule.from = {{"::", 0}}; });
    row("two", true, true, [](Rule& rule) { rule.from = {{"fd00::7", 128}, {"10.0.0.7", 32}}; });
    row("role", true, false, [](Rule& rule) { rule.roles = {"viewer", "operator"}; });
    row("token", false, true, [](Rule& rule) { rule.tokens = {"boss"}; });
    row("face", true, false, [](Rule& rule) { rule.faces = {Face::modbus_tcp}; });
    row("listener", true, false, [](Rule& rule) { rule.listeners = {"0.0.0.0:502"}; });
    row("all must hold", false, false, [](Rule& rule) {
        rule.tokens = {"boss"};
        rule.faces = {Face::modbus_tcp};
    });
    for (const Row& one : rows) {
        EXPECT_EQ(is_about(one.rule, *kScada), one.scada) << one.what;
        EXPECT_EQ(is_about(one.rule, *kBoss), one.boss) << one.what;
    }
    Rule lead = empty;
    lead.roles = {"line-lead"};
    EXPECT_TRUE(is_about(lead, {.standing = Role::viewer, .certificate_role = "line-lead"}));
    EXPECT_FALSE(
        is_about(lead, {.token = "ops", .standing = Role::viewer, .certificate_role = "line-lead"}))
        << "a token counts more";
    Rule near = empty;
    near.from = {{"::", 0}};
    EXPECT_FALSE(is_about(near, {.face = Face::mqtt})) << "it has no address";
    Rule modbus = empty;
    modbus.faces = {Face::modbus_tcp};
    EXPECT_TRUE(is_about(modbus, {.face = Face::udp})) << "the same listener";
}

TEST(LineRules, ForgetsTheClientsThatItHasMetBeforeTheyAreTooMany) {
    Settings settings;
    settings.rules = {{.name = "ops-only", .acts = {Act::read}, .tokens = {"other"}}};
    const LineRules rules(std::make_shared<const Settings>(settings), "floor1", {20});
    const auto request = test::request_of("03 0000 0001"_hex);
    for (int i = 0; i < 5000; ++i) {
        const bool other = i % 3 == 0;
        const WhoRef who = make_who({.face = Face::http, .token = other ? "other" : "ops"});
        EXPECT_EQ(rules.judge(who, 20, request).allowed, !other) << i;
    }
}

}  // namespace
}  // namespace panelgate::access::line_rules_test
