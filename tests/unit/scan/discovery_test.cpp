#include "panelgate/scan/discovery.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/modbus/request.hpp"
#include "panelgate/sim/station.hpp"
#include "virtual_line.hpp"

namespace panelgate::scan::discovery_test {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::Not;
using Answer = Discovery::Answer;
using Reply = Discovery::Reply;

constexpr TimePoint kStart{1h};
constexpr Duration kAnswered = 15ms;
constexpr Duration kSilence = 40ms;

/// Simulated panels on a line shared with clients; each question has a cost, and its answer arrives
/// later than that.
class DiscoveryTest : public testing::Test {
  protected:
    DiscoveryTest() {
        settings.stations.resize(247);
        std::iota(settings.stations.begin(), settings.stations.end(), std::uint8_t{1});
        settings.format = SerialFormat{38400, 8, Parity::none, 1};
    }
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
    /// "20 panasonic-gt, 31 autonics-gplp-s": who was found, and what it is first of all.
    static std::string found(const Discovery& discovery) {
        std::string text;
        for (const StationFinding& one : discovery.findings()) {
            text += (text.empty() ? "" : ", ") + std::to_string(one.station);
            if (!one.candidates.empty()) text += ' ' + one.candidates[0].profile;
        }
        return text;
    }

    std::map<std::uint8_t, sim::Station> panels;
    std::map<std::uint8_t, int> questions;
    std::function<std::optional<Answer>(const ReadRequest&)> scripted;
    TimePoint now = kStart;
    DiscoverySettings settings;  ///< all addresses
};

TEST_F(DiscoveryTest, WhomTheLineRefusesToAskWaitsForItsTurnAndIsNotSilent) {
    add("panasonic-gt", 5);
    int refusals = 0;
    scripted = [&](const ReadRequest& request) -> std::optional<Answer> {
        if (request.station() != 5 || refusals == 2) return std::nullopt;
        ++refusals;
        return Answer{Reply::refused, {}, {}};
    };
    Discovery discovery(shipped(), settings, now);
    run(discovery);
    EXPECT_EQ(discovery.asked(), 247u);
    EXPECT_EQ(discovery.refused(), 0u);
    EXPECT_EQ(found(discovery), "5 panasonic-gt");
    EXPECT_EQ(discovery.remaining(now), Duration::zero());
}

TEST_F(DiscoveryTest, WhoIsRefusedEachTimeIsCountedAsNotAsked) {
    scripted = [](const ReadRequest& request) -> std::optional<Answer> {
        if (request.station() % 2 == 0) return std::nullopt;
        return Answer{Reply::refused, {}, {}};
    };
    Discovery discovery(shipped(), settings, now);
    EXPECT_FALSE(discovery.remaining(now)) << "nothing was asked yet";
    run(discovery);
    EXPECT_EQ(discovery.asked(), 123u);
    EXPECT_EQ(discovery.refused(), 124u);
    EXPECT_THAT(discovery.silent(), Not(Contains(1)));
}

TEST_F(DiscoveryTest, NamesWhomItReallyAskedAndWhoWasSilent) {
    add("panasonic-gt", 5);
    settings.stations = {3, 4, 5, 6, 7};
    scripted = [](const ReadRequest& request) -> std::optional<Answer> {
        if (request.station() == 4) return Answer{Reply::refused, {}, {}};
        if (request.station() == 6) return Answer{Reply::damaged, {}, kAnswered};
        return std::nullopt;
    };
    Discovery discovery(shipped(), settings, now);
    EXPECT_THAT(discovery.asked_stations(), ElementsAre());
    run(discovery);
    EXPECT_THAT(discovery.asked_stations(), ElementsAre(3, 5, 6, 7));
    EXPECT_THAT(discovery.silent(), ElementsAre(3, 7));
}

TEST_F(DiscoveryTest, WhoIsSilentAgainWhenAskedOnceMoreStaysSilent) {
    settings.stations = {9};
    Discovery discovery(shipped(), settings, now);
    run(discovery);
    discovery.ask_late(9);
    EXPECT_FALSE(discovery.done());
    run(discovery);
    EXPECT_EQ(questions[9], 2);
    EXPECT_THAT(discovery.silent(), ElementsAre(9));
    EXPECT_EQ(discovery.asked(), 1u);
    discovery.ask_late(9);
    EXPECT_TRUE(discovery.done()) << "once";
}

TEST_F(DiscoveryTest, FindsWhoAnswersAndWhatPanelItIs) {
    add("autonics-gplp-s", 31);
    add("panasonic-gt", 20);
    Discovery discovery(shipped(), settings, now);
    run(discovery);
    EXPECT_EQ(discovery.asked(), 247u);
    EXPECT_EQ(discovery.of(), 247u);
    EXPECT_EQ(found(discovery), "20 panasonic-gt, 31 autonics-gplp-s");
    EXPECT_EQ(questions[7], 1) << "who is silent is asked once";
}

TEST_F(DiscoveryTest, StaysBelowItsShareOfTheLine) {
    add("omron-cp2e", 1);
    for (const double share : {0.01, 0.1, 0.5, 1.0}) {
        settings.share = share;
        Discovery discovery(shipped(), settings, now);
        EXPECT_LE(run(discovery), share * 1.001) << share;
        now = discovery.due();
    }
}

TEST_F(DiscoveryTest, NeverTakesMoreThanItsShareOfAnyStretchButOneQuestion) {
    add("omron-cp2e", 100);
    Discovery discovery(shipped(), settings, now);
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
    Discovery discovery(shipped(), settings, now);
    EXPECT_TRUE(discovery.question(now));
    EXPECT_TRUE(discovery.question(now)) << "the same until it is answered";
    discovery.on_answer(now + 40ms, {Reply::silent, {}, 40ms});
    EXPECT_FALSE(discovery.question(now + 399ms));
    EXPECT_TRUE(discovery.question(now + 400ms));
    EXPECT_EQ(discovery.due(), now + 400ms);
}

TEST_F(DiscoveryTest, WhatTheLineCouldNotTakeIsAskedAgain) {
    settings.stations = {9};
    Discovery discovery(shipped(), settings, now);
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
    scripted = [&](const ReadRequest& request) -> std::optional<Answer> {
        if (request.station() == 5 || (request.station() == 6 && questions[6] == 1))
            return Answer{Reply::damaged, {}, kAnswered};
        return std::nullopt;
    };
    Discovery discovery(shipped(), settings, now);
    run(discovery);
    EXPECT_EQ(found(discovery), "5");
    EXPECT_EQ(discovery.findings().at(0).evidence.damaged, 3u);
    EXPECT_EQ(questions[6], 2);
}

TEST_F(DiscoveryTest, WhoAnswersLateMayBeAskedOnceMore) {
    add("autonics-gplp-s", 31);
    scripted = [&](const ReadRequest& request) -> std::optional<Answer> {
        if (request.station() == 31 && questions[31] > 1) return std::nullopt;
        return Answer{Reply::silent, {}, kSilence};
    };
    Discovery discovery(shipped(), settings, now);
    run(discovery);
    EXPECT_TRUE(discovery.silent().contains(31));
    EXPECT_EQ(found(discovery), "");
    discovery.ask_late(31);
    EXPECT_FALSE(discovery.done());
    run(discovery);
    EXPECT_EQ(discovery.asked(), 247u);
    EXPECT_EQ(found(discovery), "31 autonics-gplp-s");
    EXPECT_EQ(discovery.findings().at(0).evidence.late, 1u);
    EXPECT_FALSE(discovery.silent().contains(31));
    discovery.ask_late(31);
    EXPECT_TRUE(discovery.done()) << "once";
}

TEST_F(DiscoveryTest, WhoGoesAwayWhileLookedAtIsToldByWhatItSaid) {
    add("autonics-gplp-s", 31);
    scripted = [&](const ReadRequest& request) -> std::optional<Answer> {
        if (request.station() != 31 || questions[31] < 3) return std::nullopt;
        return Answer{Reply::silent, {}, 1s};
    };
    Discovery discovery(shipped(), settings, now);
    run(discovery);
    EXPECT_EQ(discovery.findings().size(), 1u);
    EXPECT_EQ(questions[31], 5) << "three silences are enough";
}

TEST_F(DiscoveryTest, HasNothingToAskWhereEverybodyIsKnown) {
    settings.stations.clear();
    Discovery discovery(shipped(), settings, now);
    EXPECT_TRUE(discovery.done());
    EXPECT_FALSE(discovery.gave_up());
}

}  // namespace
}  // namespace panelgate::scan::discovery_test
