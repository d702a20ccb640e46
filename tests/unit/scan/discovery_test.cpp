#include "panelgate/scan/discovery.hpp"

#include <gmock/gmock.h>

#include <functional>
#include <map>
#include <numeric>
#include <vector>

#include "panelgate/modbus/request.hpp"
#include "virtual_line.hpp"

namespace panelgate::scan::discovery_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Answer = Discovery::Answer;
using Reply = Discovery::Reply;

constexpr TimePoint kStart{1h};
constexpr Duration kAnswered = 15ms;
constexpr Duration kSilence = 40ms;
const SerialFormat k38400{38400, 8, Parity::none, 1};

/// Simulated panels on a line shared with clients; each question has a cost, and its answer arrives
/// later than that.
class DiscoveryTest : public testing::Test {
  protected:
    void add(const std::string& profile, std::uint8_t station) {
        panels.try_emplace(station, *shipped().find(profile), station);
    }
    Answer ask(const ReadRequest& request) {
        ++questions[request.station()];
        EXPECT_TRUE(modbus::is_pure_read(Bytes(request.pdu().begin(), request.pdu().end())));
        if (scripted) {
            if (auto answer = scripted(request)) return *answer;
        }
        const auto panel = panels.find(request.station());
        if (panel == panels.end()) return {Reply::silent, {}, kSilence};
        return {Reply::answered, panel->second.handle(now, 0, request.pdu()), kAnswered};
    }
    /// Runs to the end; returns the share of time used.
    double run(Discovery& discovery) {
        const TimePoint began = now;
        Duration cost{};
        while (!discovery.done()) {
            now = std::max(now, discovery.due());
            const auto request = discovery.question(now);
            if (!request) ADD_FAILURE() << "nothing to ask at " << to_seconds(now - kStart);
            if (!request) return 1;
            const Answer answer = ask(*request);
            cost += answer.cost;
            now += answer.cost + 3ms;  // time in the queue
            discovery.on_answer(now, answer);
        }
        return to_seconds(cost) / to_seconds(std::max(now, discovery.due()) - began);
    }
    static DiscoverySettings all(double share = 0.1) {
        DiscoverySettings settings;
        settings.stations.resize(247);
        std::iota(settings.stations.begin(), settings.stations.end(), std::uint8_t{1});
        settings.share = share;
        settings.format = k38400;
        return settings;
    }

    std::map<std::uint8_t, sim::Station> panels;
    std::map<std::uint8_t, int> questions;
    std::function<std::optional<Answer>(const ReadRequest&)> scripted;
    TimePoint now = kStart;
};

TEST_F(DiscoveryTest, WhomTheLineRefusesToAskWaitsForItsTurnAndIsNotSilent) {
    add("panasonic-gt", 5);
    int refusals = 0;
    scripted = [&](const ReadRequest& request) -> std::optional<Answer> {
        if (request.station() != 5 || refusals == 2) return std::nullopt;
        ++refusals;
        return Answer{Reply::refused, {}, {}};
    };
    Discovery discovery(shipped(), all(), now);
    run(discovery);
    EXPECT_EQ(discovery.asked(), 247u);
    EXPECT_EQ(discovery.refused(), 0u);
    ASSERT_EQ(discovery.findings().size(), 1u);
    EXPECT_EQ(discovery.findings()[0].station, 5);
    EXPECT_EQ(discovery.remaining(now), Duration::zero());
}

TEST_F(DiscoveryTest, WhoIsRefusedEachTimeIsCountedAsNotAsked) {
    scripted = [](const ReadRequest& request) -> std::optional<Answer> {
        if (request.station() % 2 == 0) return std::nullopt;
        return Answer{Reply::refused, {}, {}};
    };
    Discovery discovery(shipped(), all(), now);
    EXPECT_FALSE(discovery.remaining(now)) << "nothing was asked yet";
    run(discovery);
    EXPECT_EQ(discovery.asked(), 123u);
    EXPECT_EQ(discovery.refused(), 124u);
    EXPECT_THAT(discovery.silent(), testing::Not(testing::Contains(1)));
}

TEST_F(DiscoveryTest, FindsWhoAnswersAndWhatPanelItIs) {
    add("autonics-gplp-s", 31);
    add("panasonic-gt", 20);
    Discovery discovery(shipped(), all(), now);
    run(discovery);
    EXPECT_EQ(discovery.asked(), 247u);
    EXPECT_EQ(discovery.of(), 247u);
    const auto found = discovery.findings();
    ASSERT_EQ(found.size(), 2u);
    EXPECT_EQ(found[0].station, 20);
    EXPECT_EQ(found[0].candidates.at(0).profile, "panasonic-gt");
    EXPECT_EQ(found[1].station, 31);
    EXPECT_EQ(found[1].candidates.at(0).profile, "autonics-gplp-s");
    EXPECT_EQ(questions[7], 1) << "who is silent is asked once";
}

TEST_F(DiscoveryTest, StaysBelowItsShareOfTheLine) {
    add("omron-cp2e", 1);
    for (const double share : {0.01, 0.1, 0.5, 1.0}) {
        Discovery discovery(shipped(), all(share), now);
        EXPECT_LE(run(discovery), share * 1.001) << share;
        now = discovery.due();
    }
}

TEST_F(DiscoveryTest, NeverTakesMoreThanItsShareOfAnyStretchButOneQuestion) {
    add("omron-cp2e", 100);
    Discovery discovery(shipped(), all(), now);
    std::vector<std::pair<TimePoint, Duration>> spent;
    scripted = [&](const ReadRequest& request) -> std::optional<Answer> {
        const Duration cost = request.station() % 50 == 0 ? 500ms : kSilence;
        spent.emplace_back(now, cost);
        return Answer{Reply::silent, {}, cost};
    };
    run(discovery);
    for (std::size_t from = 0; from < spent.size(); ++from) {
        Duration sum{};
        for (std::size_t to = from; to + 1 < spent.size(); ++to) {
            sum += spent[to].second;
            EXPECT_LE(to_seconds(sum),
                      0.1001 * to_seconds(spent[to + 1].first - spent[from].first));
        }
    }
}

TEST_F(DiscoveryTest, NothingIsAskedBeforeItsTime) {
    Discovery discovery(shipped(), all(), now);
    EXPECT_TRUE(discovery.question(now));
    EXPECT_TRUE(discovery.question(now)) << "the same until it is answered";
    discovery.on_answer(now + 40ms, {Reply::silent, {}, 40ms});
    EXPECT_FALSE(discovery.question(now + 399ms));
    EXPECT_TRUE(discovery.question(now + 400ms));
    EXPECT_EQ(discovery.due(), now + 400ms);
}

TEST_F(DiscoveryTest, WhatTheLineCouldNotTakeIsAskedAgain) {
    DiscoverySettings one = all();
    one.stations = {9};
    Discovery discovery(shipped(), one, now);
    discovery.on_answer(now, {Reply::unsent});
    EXPECT_EQ(discovery.asked(), 0u);
    EXPECT_FALSE(discovery.question(now + 999ms));
    EXPECT_EQ(discovery.question(now + 1s)->station(), 9);
    scripted = [](const ReadRequest&) { return Answer{Reply::unsent}; };
    run(discovery);
    EXPECT_TRUE(discovery.gave_up());
    EXPECT_EQ(questions[9], 59) << "not for ever";
}

TEST_F(DiscoveryTest, DamageIsAStationOnlyWhenItComesAgainAndAgain) {
    std::map<std::uint8_t, int> tries;
    scripted = [&](const ReadRequest& request) -> std::optional<Answer> {
        const int nth = ++tries[request.station()];
        if (request.station() == 5 || (request.station() == 6 && nth == 1))
            return Answer{Reply::damaged, {}, kAnswered};
        return std::nullopt;
    };
    Discovery discovery(shipped(), all(), now);
    run(discovery);
    const auto found = discovery.findings();
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].station, 5);
    EXPECT_EQ(found[0].evidence.damaged, 3u);
    EXPECT_TRUE(found[0].candidates.empty());
    EXPECT_EQ(tries[6], 2);
}

TEST_F(DiscoveryTest, WhoAnswersLateMayBeAskedOnceMore) {
    add("autonics-gplp-s", 31);
    scripted = [&](const ReadRequest& request) -> std::optional<Answer> {
        if (request.station() == 31 && questions[31] > 1) return std::nullopt;
        return Answer{Reply::silent, {}, kSilence};
    };
    Discovery discovery(shipped(), all(), now);
    run(discovery);
    EXPECT_TRUE(discovery.silent().contains(31));
    EXPECT_TRUE(discovery.findings().empty());
    discovery.ask_late(31);
    EXPECT_FALSE(discovery.done());
    run(discovery);
    EXPECT_EQ(discovery.asked(), 247u);
    ASSERT_EQ(discovery.findings().size(), 1u);
    EXPECT_EQ(discovery.findings()[0].candidates.at(0).profile, "autonics-gplp-s");
    EXPECT_EQ(discovery.findings()[0].evidence.late, 1u);
    discovery.ask_late(31);
    EXPECT_TRUE(discovery.done()) << "once";
}

TEST_F(DiscoveryTest, WhoGoesAwayWhileLookedAtIsToldByWhatItSaid) {
    add("autonics-gplp-s", 31);
    scripted = [&](const ReadRequest& request) -> std::optional<Answer> {
        if (request.station() != 31 || questions[31] < 3) return std::nullopt;
        return Answer{Reply::silent, {}, 1s};
    };
    Discovery discovery(shipped(), all(), now);
    run(discovery);
    EXPECT_EQ(discovery.findings().size(), 1u);
    EXPECT_EQ(questions[31], 5) << "three silences are enough";
}

TEST_F(DiscoveryTest, HasNothingToAskWhereEverybodyIsKnown) {
    DiscoverySettings none = all();
    none.stations.clear();
    Discovery discovery(shipped(), none, now);
    EXPECT_TRUE(discovery.done());
    EXPECT_FALSE(discovery.gave_up());
}

}  // namespace
}  // namespace panelgate::scan::discovery_test
