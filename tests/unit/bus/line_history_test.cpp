// How busy a line is now, and its figures of the last hour.
#include "panelgate/bus/line_history.hpp"

#include <gtest/gtest.h>

#include <cstddef>

namespace panelgate::bus::line_history_test {
namespace {

constexpr TimePoint kStart{1h};

class LoadMeterTest : public ::testing::Test {
  protected:
    /// Records a second that was busy for this long at its end, and returns the load in per cent.
    double second(Duration busy_for) {
        now += 1s;
        busy += busy_for;
        meter.record(now, busy);
        return meter.percent(now);
    }
    double seconds(int many, Duration each) {
        double load = 0;
        for (int i = 0; i < many; ++i) load = second(each);
        return load;
    }

    LoadMeter meter{kStart};
    TimePoint now = kStart;
    Duration busy{};
};

TEST_F(LoadMeterTest, AnEvenLoadIsItsShareFromTheFirstSecondOn) {
    EXPECT_EQ(meter.percent(kStart), 0) << "no time has passed";
    LoadMeter early(kStart);
    early.record(kStart + 400ms, 100ms);
    EXPECT_NEAR(early.percent(kStart + 500ms), 20, 1e-9);
    for (int i = 0; i < 20; ++i) EXPECT_EQ(second(0s), 0);
    meter = LoadMeter(now);
    busy = {};
    for (int i = 0; i < 20; ++i) EXPECT_NEAR(second(250ms), 25, 1e-9) << i;
}

TEST_F(LoadMeterTest, FollowsAChangeInTenSeconds) {
    seconds(60, 900ms);
    EXPECT_NEAR(seconds(10, 100ms), 10, 1e-9);
    EXPECT_NEAR(seconds(10, 1s), 100, 1e-9);
}

TEST_F(LoadMeterTest, AShortPeakCountsForTenSecondsAndIsForgotten) {
    seconds(12, 0s);
    EXPECT_NEAR(second(1s), 10, 1e-9);
    for (int i = 0; i < 9; ++i) EXPECT_NEAR(second(0s), 10, 1e-9) << i;
    EXPECT_EQ(second(0s), 0);
}

TEST_F(LoadMeterTest, WhoAsksOftenAndWhoAsksSeldomAreToldTheSame) {
    LoadMeter lonely(kStart);
    for (int i = 0; i < 100; ++i) {
        now += 137ms;
        busy += i < 60 ? 90ms : 3ms;
        meter.record(now, busy);
        lonely.record(now, busy);
        for (int k = 0; k < 3; ++k) static_cast<void>(meter.percent(now));
    }
    EXPECT_EQ(meter.percent(now), lonely.percent(now));
    EXPECT_GT(meter.percent(now), 0);
    EXPECT_EQ(lonely.percent(now + 25s), 0) << "an idle line";
}

TEST_F(LoadMeterTest, ATransactionOfSeveralSecondsIsSpreadOverThem) {
    now += 20s;
    meter.record(now + 500ms, 4s);
    EXPECT_NEAR(meter.percent(now), 35, 1e-9) << "half a second of it is not over yet";
    EXPECT_NEAR(meter.percent(now + 1s), 40, 1e-9);
    EXPECT_NEAR(meter.percent(now + 9s), 15, 1e-9)
        << "the half second before, and the one that was not over";
}

TEST_F(LoadMeterTest, IsNeverAboveAllOfIt) {
    for (int i = 0; i < 12; ++i) EXPECT_LE(second(2s), 100) << "the gap behind a frame counts too";
}

class LineHistoryTest : public testing::Test {
  protected:
    LineHistoryTest() {
        report.up = true;
        report.stations.resize(2);
        report.stations[0].station = "press";
        report.stations[1].station = "oven";
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

TEST_F(LineHistoryTest, AStationThatIsLeftOutAndComesBackCountsFromZero) {
    const auto ask = [&](std::size_t station, int times) {
        for (int i = 0; i < times; ++i) {
            request(station, Outcome::timeout, 100ms);
            report.stations[station].wire.bus_transaction.observe(50ms);
        }
    };
    ask(0, 5);
    ask(1, 3);
    next();
    report.stations.erase(report.stations.begin());
    ask(0, 1);
    LineSample last = next();
    EXPECT_EQ(last.requests, 1u);
    EXPECT_EQ(last.errors, 1u);
    EXPECT_NEAR(*last.latency_ms, 100, 1e-9);
    report.stations.emplace_back().station = "press";
    ask(1, 2);
    last = next();
    EXPECT_EQ(last.requests, 2u);
    EXPECT_NEAR(*last.wire_ms, 50, 1e-9);
    report.stations.back() = {};  // away and back between two calls
    report.stations.back().station = "press";
    ask(1, 1);
    EXPECT_EQ(next().errors, 1u);
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
    EXPECT_EQ(next().at, kStart + 5s) << "since the last look";
    EXPECT_EQ(next().at, kStart + 30s);
    EXPECT_EQ(history.samples(now).size(), 3u);
}

}  // namespace
}  // namespace panelgate::bus::line_history_test
