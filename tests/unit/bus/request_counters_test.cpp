#include "accounts.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "support/hex.hpp"

namespace panelgate::bus::request_counters_test {
namespace {

Answer answer(Result<Bytes> pdu, bool transmitted = true) {
    Answer made;
    made.pdu = std::move(pdu);
    made.transmitted = transmitted;
    return made;
}
std::string word(const Answer& answer) { return std::string(label(outcome_of(answer))); }

TEST(OutcomeOf, ToldByWhoAnswered) {
    const Bytes reply = "03 02 00 07"_hex;
    EXPECT_EQ(word(answer(reply)), "ok");
    Answer shared = answer(reply);
    shared.shared = true;
    EXPECT_EQ(word(shared), "shared");
    Answer remembered = answer(reply, false);
    remembered.source = Source::cache;
    EXPECT_EQ(word(remembered), "cached");
}

TEST(OutcomeOf, AnExceptionIsThePanelsOnlyWhereThePanelWasAsked) {
    EXPECT_EQ(word(answer("83 02"_hex)), "exception");
    EXPECT_EQ(word(answer("83 02"_hex, false)), "refused");
}

TEST(OutcomeOf, AFaultHasItsOwnWord) {
    EXPECT_EQ(word(answer(Fault::timeout)), "timeout");
    EXPECT_EQ(word(answer(Fault::busy, false)), "busy");
}

std::uint64_t observed(const Histogram& histogram) {
    return std::accumulate(histogram.counts.begin(), histogram.counts.end(), std::uint64_t{0});
}

class RequestCountersTest : public ::testing::Test {
  protected:
    RequestCountersTest() {
        settings.stations = {settings.unlisted};
        settings.stations[0].id = 17;
    }
    StationReport of(const std::string& station) const {
        for (StationReport& report : counters.report(arbiter::Arbiter(settings)))
            if (report.station == station) return std::move(report);
        ADD_FAILURE() << "no station " << station;
        return {};
    }
    void ask(std::uint8_t station, std::uint8_t function, Duration took = 1ms) {
        counters.count(station, function, outcome_of(answer(Bytes{function, 0})), took);
    }

    arbiter::Settings settings;
    RequestCounters counters{{{17, {"press"}}}};
};

TEST_F(RequestCountersTest, AStationThatWasNeverAskedIsReportedAllTheSame) {
    const StationReport press = of("press");
    EXPECT_TRUE(press.configured);
    EXPECT_FALSE(press.up);
    EXPECT_TRUE(press.requests.empty());
    EXPECT_EQ(press.last_success_unix, 0);
    EXPECT_FALSE(of("other").configured);
}

TEST_F(RequestCountersTest, WhatAPanelIsLikelyToBeAskedIsCountedFromTheStart) {
    counters = RequestCounters({{17, {.name = "press", .functions = {3, 16}}}});
    const StationReport press = of("press");
    ASSERT_EQ(press.requests.size(), 2u);
    EXPECT_EQ(press.requests.at(3)[Outcome::ok], 0u);
    EXPECT_TRUE(press.requests.contains(16));
}

TEST_F(RequestCountersTest, EachFunctionAndEachOutcomeCountsByItself) {
    ask(17, 3, 2ms);
    ask(17, 3, 4ms);
    ask(17, 6);
    counters.count(17, 3, outcome_of(answer(Fault::timeout)), 500ms);
    const StationReport press = of("press");
    ASSERT_EQ(press.requests.size(), 2u);
    EXPECT_EQ(press.requests.at(3)[Outcome::ok], 2u);
    EXPECT_EQ(press.requests.at(3)[Outcome::timeout], 1u);
    EXPECT_EQ(press.requests.at(6)[Outcome::ok], 1u);
    EXPECT_EQ(observed(press.request_duration), 4u);
    EXPECT_TRUE(of("other").requests.empty());
}

TEST_F(RequestCountersTest, OutcomesAreThoseOfAllFunctionsOfAListedStation) {
    ask(17, 3);
    ask(17, 6);
    counters.count(17, 4, outcome_of(answer(Fault::timeout)), 500ms);
    ask(18, 3);
    EXPECT_EQ(counters.outcomes(17)[Outcome::ok], 2u);
    EXPECT_EQ(counters.outcomes(17)[Outcome::timeout], 1u);
    EXPECT_EQ(counters.outcomes(18)[Outcome::ok], 0u) << "it is among others";
    EXPECT_EQ(counters.outcomes(0)[Outcome::ok], 0u);
}

TEST_F(RequestCountersTest, P10NoClientCanAddASeries) {
    for (unsigned station = 0; station <= 255; ++station) {
        if (station == 17) continue;
        for (unsigned function = 0; function <= 255; ++function)
            ask(static_cast<std::uint8_t>(station), static_cast<std::uint8_t>(function));
    }
    EXPECT_EQ(counters.report(arbiter::Arbiter(settings)).size(), 2u);
    const StationReport other = of("other");
    EXPECT_LT(other.requests.size(), 25u) << "those of the standard, and one for all the others";
    EXPECT_EQ(observed(other.request_duration), 255u * 256u);
}

TEST_F(RequestCountersTest, TheLastSuccessIsThatOfItsStation) {
    counters.succeeded(17, 1000.5);
    counters.succeeded(99, 2000.5);
    EXPECT_EQ(of("press").last_success_unix, 1000.5);
    EXPECT_EQ(of("other").last_success_unix, 2000.5);
}

}  // namespace
}  // namespace panelgate::bus::request_counters_test
