#include "panelgate/points/report.hpp"

#include <gtest/gtest.h>

namespace panelgate::points::report_test {
namespace {

/// One point's rule; each call is a reading at that moment.
struct Reports {
    ReportRule rule;
    Told told{};

    Report at(Duration when, Value value, Quality quality = Quality::good) {
        PointReading reading;
        reading.value = std::move(value);
        reading.quality = quality;
        return told.take(rule, reading, TimePoint{} + when);
    }
};

TEST(ReportRules, ADeadbandCountsFromWhatWasTold) {
    Reports reports{{.deadband = 0.5}};
    EXPECT_EQ(reports.at(0s, 20.0), Report::changed) << "the first reading";
    EXPECT_EQ(reports.at(1s, 20.3), Report::none);
    EXPECT_EQ(reports.at(2s, 20.4), Report::none);
    EXPECT_EQ(reports.at(3s, 20.5), Report::changed) << "slow drift is told, too";
    EXPECT_EQ(reports.at(4s, 20.1), Report::none);
    EXPECT_EQ(reports.at(5s, 20.0), Report::changed);
}

TEST(ReportRules, AnotherQualityIsToldAtOnce) {
    Reports reports{{.deadband = 100.0, .at_most = 10s}};
    reports.at(0s, 20.0);
    EXPECT_EQ(reports.at(1s, 20.0, Quality::stale), Report::changed);
    EXPECT_EQ(reports.at(2s, 20.0, Quality::stale), Report::none);
    EXPECT_EQ(reports.at(3s, 20.0), Report::changed);
}

TEST(ReportRules, ChangesAreHeldBackAndTheLastIsTold) {
    Reports reports{{.at_most = 10s}};
    reports.at(0s, std::int64_t{1});
    EXPECT_EQ(reports.at(3s, std::int64_t{2}), Report::none);
    EXPECT_EQ(reports.at(9s, std::int64_t{3}), Report::none);
    EXPECT_EQ(reports.at(10s, std::int64_t{3}), Report::changed);
    EXPECT_EQ(reports.at(60s, std::int64_t{3}), Report::none) << "nothing has changed";
}

TEST(ReportRules, AnUnchangedValueIsToldAgain) {
    Reports reports{{.at_least = 60s}};
    reports.at(0s, std::string("A7"));
    EXPECT_EQ(reports.at(59s, std::string("A7")), Report::none);
    EXPECT_EQ(reports.at(60s, std::string("A7")), Report::again);
    EXPECT_EQ(reports.at(61s, std::string("A7")), Report::none);
    EXPECT_EQ(reports.at(62s, std::string("B1")), Report::changed);
}

}  // namespace
}  // namespace panelgate::points::report_test
