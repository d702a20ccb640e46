// Rules of access at the bus: before cache, joining and sharing, and again when they change.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bus_case.hpp"
#include "panelgate/access/line_rules.hpp"
#include "panelgate/rt/log.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::bus::bus_access_test {
namespace {

using access::Act;

const WhoRef kOperator =
    make_who({.face = Face::http, .name = "http ops", .standing = Role::operator_});
const WhoRef kViewer = make_who({.face = Face::http, .name = "http eye", .standing = Role::viewer});

/// Viewers read nothing of 17; nobody writes register 1.
class BusAccessTest : public BusCase {
  protected:
    BusAccessTest() {
        access::Rule blind{.name = "blind", .acts = {Act::read}, .roles = {"viewer"}};
        blind.stations = {{"floor1", 17}};
        access::Rule fixed{.name = "fixed", .acts = {Act::write}};
        fixed.range = "holding-registers/1";
        fixed.unlisted_items = modbus::Span{modbus::Table::holding_registers, 1, 1};
        rules.rules = {blind, fixed};
        use_rules();
        start_bus();
    }
    void use_rules() {
        settings.access = std::make_shared<const access::LineRules>(
            std::make_shared<const access::Settings>(rules), "floor1",
            std::vector<std::uint8_t>{17});
    }
    Answer ask_as(WhoRef asker, std::uint8_t station, const Bytes& pdu) {
        who = std::move(asker);
        return ask(station, pdu);
    }
    static std::string rule_of(const Answer& answer) {
        return answer.refusal ? answer.refusal->why : "";
    }

    access::Settings rules;
};

TEST_F(BusAccessTest, WhatARuleDeniesIsRefusedWithItsNameCountedAndNeverSent) {
    const rt::LogTap log;
    const Answer write = ask_as(kOperator, 17, kWrite);
    EXPECT_EQ(end_of(write), "denied");
    EXPECT_EQ(write.refusal.value().rule, Rule::denied);
    EXPECT_EQ(rule_of(write), "fixed");
    EXPECT_EQ(rule_of(ask_as(kOperator, 0, kWrite)), "fixed") << "a broadcast writes it, too";
    EXPECT_EQ(rule_of(ask_as(kViewer, 17, kRead)), "blind");
    EXPECT_TRUE(line->written.empty());
    const auto denials = bus->report().denials;
    EXPECT_EQ(denials.at("fixed"), 2u);
    EXPECT_EQ(denials.at("blind"), 1u);
    EXPECT_EQ(denials.at("default"), 0u) << "what may refuse is there from the start";
    EXPECT_GE(log.count("client=\"http ops\""), 1u);
    EXPECT_GE(log.count("rule=fixed"), 1u);
    EXPECT_TRUE(ask_as(kOperator, 17, kRead).pdu.has_value());
}

TEST_F(BusAccessTest, P6NobodyIsAnsweredFromAReadThatHeMayNotMake) {
    std::vector<Answer> allowed;
    std::vector<Answer> denied;
    who = kOperator;
    send(17, kRead, allowed);
    send(17, kRead, allowed);
    who = kViewer;
    send(17, kRead, denied);
    ASSERT_TRUE(run_until([&] { return allowed.size() == 2 && denied.size() == 1; }));
    EXPECT_EQ(rule_of(denied[0]), "blind");
    EXPECT_TRUE(allowed[0].pdu.has_value());
    EXPECT_TRUE(allowed[1].pdu.has_value());
}

TEST_F(BusAccessTest, P2WhatWaitsIsJudgedAgainWhenTheRulesChange) {
    std::vector<Answer> answers;
    who = kOperator;
    send(17, kRead, answers);  // keeps the line busy
    send(17, "06 00 02 00 01"_hex, answers);
    send(18, kRead, answers);
    rules.rules.insert(rules.rules.begin(), access::Rule{.name = "closed", .acts = {Act::write}});
    use_rules();
    bus->apply(settings, nullptr, nullptr);
    ASSERT_TRUE(run_until([&] { return answers.size() == 3; }));
    EXPECT_EQ(std::ranges::count(answers, std::string("closed"), rule_of), 1);
    EXPECT_EQ(bus->report().denials.at("closed"), 1u);
    EXPECT_EQ(std::ranges::count(answers, true, &Answer::transmitted), 2) << "the reads";
}

TEST_F(BusAccessTest, P2AWriteThatWasSentIsNotRepeatedAfterItIsForbidden) {
    settings.arbiter.stations[0].retry_writes = true;
    settings.arbiter.stations[0].retries = 2;
    bus->apply(settings, nullptr, nullptr);
    ask_as(kOperator, 17, kRead);  // the station is healthy
    const std::size_t before = line->written.size();
    line->reply.clear();
    std::vector<Answer> answers;
    send(17, "06 00 02 00 01"_hex, answers);
    ASSERT_TRUE(run_until([&] { return line->written.size() > before; }));
    rules.rules.insert(rules.rules.begin(), access::Rule{.name = "closed", .acts = {Act::write}});
    use_rules();
    bus->apply(settings, nullptr, nullptr);
    ASSERT_TRUE(run_until([&] { return !answers.empty(); }));
    EXPECT_EQ(line->written.size(), before + 1) << "once";
    EXPECT_EQ(end_of(answers[0]), "timeout, sent") << "what became of it nobody knows";
    EXPECT_EQ(rule_of(answers[0]), "");
}

TEST_F(BusAccessTest, P2WhatWaitsIsJudgedByWhatItsDoorSaysNow) {
    std::optional<Admission> now;
    settings.admit = [&](const WhoRef& asker, std::uint8_t) {
        return asker == kOperator ? now : std::optional<Admission>();
    };
    bus->apply(settings, nullptr, nullptr);
    panelgate::Rights reads;
    reads.add(Right::read);
    const Admission lowered{.who = kViewer, .may = reads};
    const Admission out{.who = kOperator, .rule = "token", .why = "its token is not known"};
    const std::pair<Admission, std::vector<std::string>> cases[] = {
        {out, {"token", "token", "token"}}, {lowered, {"viewer", "blind", ""}}};
    std::uint8_t silent = 19;
    for (const auto& [changed, expected] : cases) {
        now.reset();
        std::vector<Answer> answers[3];
        std::vector<Answer> first;
        const std::size_t before = line->written.size();
        line->reply.clear();
        who = kOperator;
        send(silent++, kRead, first);
        ASSERT_TRUE(run_until([&] { return line->written.size() > before; }));
        send(17, "06 00 02 00 01"_hex, answers[0]);  // they wait for its reply
        send(17, kRead, answers[1]);
        send(18, kRead, answers[2]);
        now = changed;
        bus->judge_waiting();
        ASSERT_TRUE(run_until([&] {
            return std::ranges::all_of(answers, [](const auto& all) { return !all.empty(); });
        }));
        for (std::size_t i = 0; i < 3; ++i) {
            EXPECT_EQ(rule_of(answers[i][0]), expected[i]) << i;
            EXPECT_EQ(answers[i][0].transmitted, expected[i].empty()) << i;
        }
    }
    EXPECT_EQ(rule_of(ask_as(kOperator, 17, kWrite)), "viewer") << "the rest of a batch";
}

TEST_F(BusAccessTest, TellsOfWhatMayBeRead) {
    EXPECT_FALSE(bus->tells(kViewer, 17));
    EXPECT_TRUE(bus->tells(kViewer, 18));
    EXPECT_FALSE(bus->tells(kViewer, 0)) << "no listed station of the line";
    EXPECT_TRUE(bus->tells(kOperator, 0));
    bus->count_denied("blind");
    EXPECT_EQ(bus->report().denials.at("blind"), 1u);
}

TEST_F(BusAccessTest, SaysWhatItWouldRefuseToThoseWhoAskOtherLinesAsWell) {
    Request broadcast{.station = 0, .request = test::request_of(kWrite), .who = kOperator};
    EXPECT_EQ(bus->refusal_of(broadcast).value().why, "fixed");
    broadcast.request = test::request_of("06 00 02 00 01"_hex);
    EXPECT_EQ(bus->refusal_of(broadcast), std::nullopt);
    const std::uint64_t before = bus->report().denials.at("fixed");
    bus->count_refused(0, kWrite, kOperator);
    EXPECT_EQ(bus->report().denials.at("fixed"), before + 1);
}

TEST_F(BusAccessTest, TheGatewaysOwnRequestsAreNotJudged) {
    EXPECT_TRUE(ask_as(own_task("poll of press"), 17, kRead).pdu.has_value());
    who = own_task("relay");
    line->reply = kWrite;
    EXPECT_TRUE(ask(17, kWrite).pdu.has_value());
}

}  // namespace
}  // namespace panelgate::bus::bus_access_test
