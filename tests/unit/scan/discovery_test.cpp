#include "panelgate/scan/discovery.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
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

/// Stations `first` to `last` answer their questions number `from` to `to` like this.
struct Script {
    std::uint8_t first;
    std::uint8_t last;
    int from;
    int to;
    Answer answer;
};
const Answer kRefused{Reply::refused, {}, {}};
const Answer kDamaged{Reply::damaged, {}, kAnswered};
const Answer kSilent{Reply::silent, {}, kSilence};

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
        const std::uint8_t station = request.station();
        const int nth = ++questions[station];
        EXPECT_TRUE(modbus::is_pure_read(Bytes(request.pdu().begin(), request.pdu().end())));
        for (const Script& one : script) {
            if (one.first <= station && station <= one.last && one.from <= nth && nth <= one.to)
                return one.answer;
        }
        const auto panel = panels.find(station);
        if (panel == panels.end()) return kSilent;
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
            spent.emplace_back(now, answer.cost);
            cost += answer.cost;
            now += answer.cost + 3ms;  // time in the queue
            discovery.on_answer(now, answer);
        }
        return to_seconds(cost) / to_seconds(std::max(now, discovery.due()) - began);
    }
    /// One that has run to its end.
    Discovery& searched() {
        run(made.emplace(shipped(), settings, now));
        return *made;
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
    std::vector<Script> script;  ///< the first that fits counts; else the panels answer
    std::vector<std::pair<TimePoint, Duration>> spent;
    TimePoint now = kStart;
    DiscoverySettings settings;  ///< all addresses
    std::optional<Discovery> made;
};

TEST_F(DiscoveryTest, WhomTheLineRefusesToAskWaitsForItsTurnAndIsNotSilent) {
    add("panasonic-gt", 5);
    script = {{5, 5, 1, 2, kRefused}};
    const Discovery& all = searched();
    EXPECT_EQ(all.asked(), 247u);
    EXPECT_EQ(all.refused(), 0u);
    EXPECT_EQ(found(all), "5 panasonic-gt");
    EXPECT_EQ(all.remaining(now), Duration::zero());
}

TEST_F(DiscoveryTest, WhoIsRefusedEachTimeIsCountedAsNotAsked) {
    script = {{1, 124, 1, 99, kRefused}};
    Discovery all(shipped(), settings, now);
    EXPECT_FALSE(all.remaining(now)) << "nothing was asked yet";
    run(all);
    EXPECT_EQ(all.asked(), 123u);
    EXPECT_EQ(all.refused(), 124u);
    EXPECT_THAT(all.silent(), Not(Contains(1)));
}

TEST_F(DiscoveryTest, NamesWhomItReallyAskedAndWhoWasSilent) {
    add("panasonic-gt", 5);
    settings.stations = {3, 4, 5, 6, 7};
    script = {{4, 4, 1, 99, kRefused}, {6, 6, 1, 99, kDamaged}};
    Discovery few(shipped(), settings, now);
    EXPECT_THAT(few.asked_stations(), ElementsAre());
    run(few);
    EXPECT_THAT(few.asked_stations(), ElementsAre(3, 5, 6, 7));
    EXPECT_THAT(few.silent(), ElementsAre(3, 7));
}

TEST_F(DiscoveryTest, WhoIsSilentAgainWhenAskedOnceMoreStaysSilent) {
    settings.stations = {9};
    Discovery& one = searched();
    one.ask_late(9);
    EXPECT_FALSE(one.done());
    run(one);
    EXPECT_EQ(questions[9], 2);
    EXPECT_THAT(one.silent(), ElementsAre(9));
    EXPECT_EQ(one.asked(), 1u);
    one.ask_late(9);
    EXPECT_TRUE(one.done()) << "once";
}

TEST_F(DiscoveryTest, FindsWhoAnswersAndWhatPanelItIs) {
    add("autonics-gplp-s", 31);
    add("panasonic-gt", 20);
    const Discovery& all = searched();
    EXPECT_EQ(all.asked(), 247u);
    EXPECT_EQ(all.of(), 247u);
    EXPECT_EQ(found(all), "20 panasonic-gt, 31 autonics-gplp-s");
    EXPECT_EQ(questions[7], 1) << "who is silent is asked once";
}

TEST_F(DiscoveryTest, StaysBelowItsShareOfTheLine) {
    add("omron-cp2e", 1);
    for (const double share : {0.01, 0.1, 0.5, 1.0}) {
        settings.share = share;
        Discovery all(shipped(), settings, now);
        EXPECT_LE(run(all), share * 1.001) << share;
        now = all.due();
    }
}

TEST_F(DiscoveryTest, NeverTakesMoreThanItsShareOfAnyStretchButOneQuestion) {
    for (const std::uint8_t station : Bytes{50, 100, 150, 200})
        script.push_back({station, station, 1, 99, {Reply::silent, {}, 500ms}});
    searched();
    ASSERT_EQ(spent.size(), 247u);
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
    Discovery all(shipped(), settings, now);
    EXPECT_TRUE(all.question(now));
    EXPECT_TRUE(all.question(now)) << "the same until it is answered";
    all.on_answer(now + 40ms, kSilent);
    EXPECT_FALSE(all.question(now + 399ms));
    EXPECT_TRUE(all.question(now + 400ms));
    EXPECT_EQ(all.due(), now + 400ms);
}

TEST_F(DiscoveryTest, WhatTheLineCouldNotTakeIsAskedAgain) {
    settings.stations = {9};
    Discovery one(shipped(), settings, now);
    one.on_answer(now, {Reply::unsent});
    EXPECT_EQ(one.asked(), 0u);
    EXPECT_FALSE(one.question(now + 999ms));
    EXPECT_EQ(one.question(now + 1s)->station(), 9);
    script = {{9, 9, 1, 99, {Reply::unsent}}};
    run(one);
    EXPECT_TRUE(one.gave_up());
    EXPECT_EQ(questions[9], 59) << "not for ever";
}

TEST_F(DiscoveryTest, DamageIsAStationOnlyWhenItComesAgainAndAgain) {
    script = {{5, 5, 1, 99, kDamaged}, {6, 6, 1, 1, kDamaged}};
    const Discovery& all = searched();
    EXPECT_EQ(found(all), "5");
    EXPECT_EQ(all.findings().at(0).evidence.damaged, 3u);
    EXPECT_EQ(questions[6], 2);
}

TEST_F(DiscoveryTest, WhoAnswersLateMayBeAskedOnceMore) {
    add("autonics-gplp-s", 31);
    script = {{31, 31, 1, 1, kSilent}};
    Discovery& all = searched();
    EXPECT_TRUE(all.silent().contains(31));
    EXPECT_EQ(found(all), "");
    all.ask_late(31);
    EXPECT_FALSE(all.done());
    run(all);
    EXPECT_EQ(all.asked(), 247u);
    EXPECT_EQ(found(all), "31 autonics-gplp-s");
    EXPECT_EQ(all.findings().at(0).evidence.late, 1u);
    EXPECT_FALSE(all.silent().contains(31));
    all.ask_late(31);
    EXPECT_TRUE(all.done()) << "once";
}

TEST_F(DiscoveryTest, WhoGoesAwayWhileLookedAtIsToldByWhatItSaid) {
    add("autonics-gplp-s", 31);
    script = {{31, 31, 3, 99, {Reply::silent, {}, 1s}}};
    EXPECT_EQ(searched().findings().size(), 1u);
    EXPECT_EQ(questions[31], 5) << "three silences are enough";
}

TEST_F(DiscoveryTest, HasNothingToAskWhereEverybodyIsKnown) {
    settings.stations.clear();
    const Discovery none(shipped(), settings, now);
    EXPECT_TRUE(none.done());
    EXPECT_FALSE(none.gave_up());
}

}  // namespace
}  // namespace panelgate::scan::discovery_test
