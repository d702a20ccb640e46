#include "panelgate/bus/line_history.hpp"

#include <gtest/gtest.h>

namespace panelgate::bus::line_history_test {
namespace {

constexpr TimePoint kStart{100s};

class LineHistoryTest : public testing::Test {
  protected:
    LineHistoryTest() {
        report.up = true;
        report.stations.resize(2);
        history.record(now, report);
    }
    /// Counts a request to the first or second station, with its duration.
    void request(std::size_t station, Outcome outcome, Duration took) {
        ++report.stations[station].requests[3][outcome];
        report.stations[station].request_duration.observe(took);
    }
    LineSample next() {
        now += 5s;
        history.record(now, report);
        return history.samples(now).back();
    }

    LineHistory history{5s};
    LineReport report;
    TimePoint now = kStart;
};

TEST_F(LineHistoryTest, HasTheFiguresOfEachSlotAndNotTheTotals) {
    report.wire.busy += 1s;
    request(0, Outcome::ok, 10ms);
    request(1, Outcome::timeout, 30ms);
    request(1, Outcome::cached, 2ms);
    report.stations[0].wire.bus_transaction.observe(8ms);
    report.queue_depth = 7;
    const LineSample first = next();
    EXPECT_EQ(first.at, kStart);
    EXPECT_NEAR(*first.load_percent, 20, 1e-9);
    EXPECT_EQ(first.requests, 3u);
    EXPECT_EQ(first.errors, 1u);
    EXPECT_NEAR(*first.latency_ms, 14, 1e-9);
    EXPECT_NEAR(*first.wire_ms, 8, 1e-9);
    EXPECT_EQ(first.queue_depth, 7u);
    report.queue_depth = 0;
    request(0, Outcome::exception, 4ms);
    const LineSample second = next();
    EXPECT_EQ(second.at, kStart + 5s);
    EXPECT_EQ(second.load_percent, 0);
    EXPECT_EQ(second.requests, 1u);
    EXPECT_EQ(second.errors, 1u);
    EXPECT_NEAR(*second.latency_ms, 4, 1e-9);
    EXPECT_EQ(history.samples(now).size(), 2u);
}

TEST_F(LineHistoryTest, P10WhatNobodyHasMeasuredIsAbsent) {
    const LineSample idle = next();
    EXPECT_EQ(idle.requests, 0u);
    EXPECT_FALSE(idle.latency_ms);
    EXPECT_FALSE(idle.wire_ms);
    report.up = false;
    EXPECT_FALSE(next().load_percent);
}

TEST_F(LineHistoryTest, KeepsAnHour) {
    for (int i = 0; i < 800; ++i) next();
    const auto samples = history.samples(now);
    EXPECT_EQ(samples.size(), 719u) << "the slot of now has no figures yet";
    EXPECT_EQ(samples.back().at, now - 5s);
    EXPECT_EQ(history.samples(now + 2h).size(), 0u);
}

TEST_F(LineHistoryTest, AMissedSlotIsAGap) {
    next();
    now += 20s;
    const LineSample late = next();
    EXPECT_EQ(late.at, kStart + 5s) << "since the last look";
    EXPECT_EQ(next().at, kStart + 30s);
    EXPECT_EQ(history.samples(now).size(), 3u);
}

}  // namespace
}  // namespace panelgate::bus::line_history_test
