#include "panelgate/rt/log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/rt/log_throttle.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::rt::log_test {
namespace {

using ::testing::ElementsAre;

constexpr TimePoint kStart{Duration(1h)};
constexpr WallTime kWall{1h};

constexpr LogThrottle::Pace kIncidents = LogThrottle::kIncidents;

/// Number of lines that pass at one per second for `length`.
int passed(LogThrottle& throttle, TimePoint from, Duration length, std::string_view subject) {
    int lines = 0;
    for (TimePoint now = from; now < from + length; now += 1s)
        lines += throttle.pass(now, "late reply", subject).has_value() ? 1 : 0;
    return lines;
}

/// True if this write of a client passes.
bool passes(LogThrottle& throttle, TimePoint now, const std::string& subject,
            std::string_view client = "10.0.0.7", std::string_view event = "write") {
    return throttle.pass(now, event, subject, LogThrottle::kActions, client).has_value();
}

std::string host(int number) { return "10.0.0." + std::to_string(number); }

TEST(LogThrottle, WhatRepeatsForAnHourIsAtMostTenLines) {
    LogThrottle throttle;
    EXPECT_EQ(passed(throttle, kStart, 1h, "floor1 31"), 8);
    EXPECT_EQ(passed(throttle, kStart + 1h, 1h, "floor1 31"), 6);
}

TEST(LogThrottle, TheLastThrottledLineIsReturnedIfNoneFollows) {
    LogThrottle throttle;
    const auto say = [&](TimePoint now, const char* line) {
        if (!throttle.pass(now, "write", "press"))
            throttle.hold("write", "press", LogLevel::info, {line});
    };
    for (int i = 0; i < kIncidents.burst; ++i) say(kStart, "passes");
    for (const char* line : {"one", "two", "three"}) say(kStart + 1s, line);
    EXPECT_TRUE(throttle.take_kept(kStart + 1min).empty());
    const auto held = throttle.take_kept(kStart + kIncidents.interval);
    ASSERT_EQ(held.size(), 1u);
    EXPECT_EQ(held[0].line.text, "three");
    EXPECT_EQ(held[0].left_out, 2u);
    EXPECT_TRUE(throttle.take_kept(TimePoint::max()).empty()) << "once";
}

TEST(LogThrottle, EachSubjectAndEachEventIsItsOwnAndTheNextPassReportsHowManyWereLeftOut) {
    LogThrottle throttle;
    EXPECT_EQ(passed(throttle, kStart, 1min, "floor1 31"), kIncidents.burst);
    EXPECT_EQ(passed(throttle, kStart, 1min, "floor1 5"), kIncidents.burst);
    EXPECT_TRUE(throttle.pass(kStart, "collision", "floor1 31"));
    for (int i = 0; i < kIncidents.burst; ++i)
        EXPECT_EQ(throttle.pass(kStart, "late", "1"), std::optional<std::uint64_t>(0));
    for (int i = 0; i < 7; ++i) EXPECT_FALSE(throttle.pass(kStart + 1s, "late", "1"));
    const TimePoint later = kStart + kIncidents.interval;
    EXPECT_EQ(throttle.pass(later, "late", "1"), std::optional<std::uint64_t>(7));
    EXPECT_FALSE(throttle.pass(later, "late", "1"));
}

TEST(LogThrottle, MoreSubjectsThanItRemembersCostNoMemoryAndLoseNoFirstLine) {
    LogThrottle throttle;
    for (std::size_t i = 0; i < 3 * LogThrottle::kMostSubjects; ++i) {
        const TimePoint now = kStart + LogThrottle::kByEvent.interval * static_cast<int>(i);
        EXPECT_TRUE(throttle.pass(now, "closed", std::to_string(i)));
    }
}

TEST(LogThrottle, AClientThatChangesTheSubjectHasABudgetOfLinesASecond) {
    LogThrottle throttle;
    int lines = 0;
    for (int i = 0; i < 100000; ++i)
        lines += passes(throttle, kStart + 100us * i, std::to_string(i)) ? 1 : 0;
    EXPECT_LE(lines, LogThrottle::kByClient.burst + 10);
    EXPECT_TRUE(passes(throttle, kStart + 10s, "1", "10.0.0.8")) << "another client has its own";
    EXPECT_TRUE(passes(throttle, kStart + 10s, "1", "10.0.0.7", "closed")) << "another event, too";
    const auto left_out = throttle.take_left_out(kStart + 2min);
    ASSERT_EQ(left_out.size(), 1u);
    EXPECT_EQ(left_out[0].event, "write");
    EXPECT_EQ(left_out[0].client, "10.0.0.7");
    EXPECT_EQ(left_out[0].count, 100000u - static_cast<unsigned>(lines));
    EXPECT_TRUE(throttle.take_left_out(kStart + 4min).empty()) << "once";
}

TEST(LogThrottle, AnyNumberOfClientsHasABudgetAndNoLineIsLostWithoutACount) {
    LogThrottle throttle;
    constexpr int kLines = 50000;
    std::uint64_t lines = 0;
    for (int i = 0; i < kLines; ++i) {
        const std::string client = "2001:db8::" + std::to_string(i / 100);
        lines += passes(throttle, kStart + 100us * i, std::to_string(i), client) ? 1 : 0;
    }
    EXPECT_LE(lines, LogThrottle::kByClients.burst + 10u);
    const auto left_out = throttle.take_left_out(TimePoint::max());
    std::uint64_t told = 0;
    for (const auto& one : left_out) told += one.count;
    EXPECT_EQ(lines + told, static_cast<std::uint64_t>(kLines));
    EXPECT_LE(left_out.size(), LogThrottle::kMostTold + 1);
    EXPECT_EQ(left_out.back().client, "");
    EXPECT_EQ(left_out.back().clients, LogThrottle::kMostClients) << "more are not counted";
}

TEST(LogThrottle, OneClientDoesNotHideAnothers) {
    LogThrottle throttle;
    for (int i = 0; i < 10000; ++i) passes(throttle, kStart + 10ms * i, std::to_string(i));
    for (int i = 0; i < 40; ++i)
        EXPECT_TRUE(passes(throttle, kStart + 100s, "8/" + std::to_string(i), "10.0.0.8"));
}

TEST(LogThrottle, ClientsTakeNothingFromEventsWithoutAClient) {
    LogThrottle throttle;
    for (int i = 0; i < 2000; ++i) throttle.pass(kStart, "late", host(i), kIncidents, host(i));
    for (int i = 0; i < LogThrottle::kByEvent.burst; ++i)
        EXPECT_TRUE(throttle.pass(kStart, "late", "station " + std::to_string(i)));
}

TEST(LogThrottle, OnlyTheClientsWithMostLinesAreReportedOneByOne) {
    LogThrottle throttle;
    constexpr int kClients = 40;
    for (int client = 0; client < kClients; ++client) {
        const int lines = LogThrottle::kByClient.burst + 10 + client;
        for (int i = 0; i < lines; ++i)
            passes(throttle, kStart + 40s * client, std::to_string(1000 * client + i),
                   host(client));
    }
    const auto told = throttle.take_left_out(TimePoint::max());
    ASSERT_EQ(told.size(), LogThrottle::kMostTold + 1);
    for (std::size_t i = 0; i < LogThrottle::kMostTold; ++i)
        EXPECT_GE(told[i].count, 10 + kClients - LogThrottle::kMostTold);
    EXPECT_EQ(told.back().client, "");
    EXPECT_EQ(told.back().clients, kClients - LogThrottle::kMostTold);
    EXPECT_EQ(told.back().count, 24u * 10 + 23 * 24 / 2) << "10, 11 and so on to 33";
}

TEST(LogThrottle, KeptLinesOfManyClientsNeedRoomInTheirBudget) {
    LogThrottle throttle;
    constexpr int kClients = 250;
    for (int i = 0; i < kClients; ++i) {
        const std::string client = host(i);
        for (int line = 0; line <= kIncidents.burst; ++line) {
            if (!throttle.pass(kStart + 2s * i, "closed", client, kIncidents, client))
                throttle.hold("closed", client, LogLevel::info, {"closed"});
        }
    }
    const std::size_t kept = throttle.take_kept(kStart + 1h).size();
    EXPECT_EQ(kept, static_cast<std::size_t>(LogThrottle::kByClients.burst));
    const auto left_out = throttle.take_left_out(TimePoint::max());
    ASSERT_EQ(left_out.size(), 1u);
    EXPECT_EQ(left_out[0].count, kClients - kept);
    EXPECT_EQ(left_out[0].clients, kClients - kept);
}

TEST(LogThrottle, ALineThatABudgetHasLeftOutIsNotKeptBesides) {
    LogThrottle throttle;
    EXPECT_TRUE(passes(throttle, kStart, "first"));
    for (int i = 0; i < LogThrottle::kByClient.burst; ++i)
        passes(throttle, kStart, std::to_string(i));
    EXPECT_FALSE(passes(throttle, kStart, "first"));
    throttle.hold("write", "first", LogLevel::info, {"first"});
    EXPECT_TRUE(throttle.take_kept(kStart + 1h).empty());
}

TEST(LogThrottle, ABudgetComesBackWithTime) {
    LogThrottle throttle;
    for (int i = 0; i < 1000; ++i) passes(throttle, kStart, std::to_string(i));
    EXPECT_FALSE(passes(throttle, kStart, "new"));
    EXPECT_TRUE(passes(throttle, kStart + LogThrottle::kByClient.interval, "new"));
    EXPECT_FALSE(passes(throttle, kStart + LogThrottle::kByClient.interval, "new"));
}

class LogRepeatsTest : public ::testing::Test {
  protected:
    /// True if it is logged at once.
    bool say(TimePoint now, const std::string& what, const std::string& place = "press/100") {
        const bool again = repeats.is_repeat(now, place, what);
        const WallTime time = kWall + std::chrono::floor<std::chrono::microseconds>(now - kStart);
        if (again) repeats.gather(place, {what}, time);
        return !again;
    }
    LogRepeats repeats;
};

TEST_F(LogRepeatsTest, DifferentEventsAreLoggedEachTimeAndOneThatIsBackAfterAMinute) {
    for (int i = 0; i < 10000; ++i) EXPECT_TRUE(say(kStart + 1ms * i, std::to_string(i)));
    for (int i = 1; i < 4; ++i) EXPECT_TRUE(say(kStart + 2min * i, "7"));
    EXPECT_TRUE(repeats.take_due(TimePoint::max()).empty());
}

TEST_F(LogRepeatsTest, RepeatsAreMergedIntoOneLineAMinuteWithCountAndTimes) {
    EXPECT_TRUE(say(kStart, "7"));
    for (int i = 1; i < 60; ++i) EXPECT_FALSE(say(kStart + 1s * i, "7"));
    EXPECT_TRUE(repeats.take_due(kStart + 59s).empty());
    const auto due = repeats.take_due(kStart + 60s);
    ASSERT_EQ(due.size(), 1u);
    EXPECT_EQ(due[0].line.text, "7");
    EXPECT_EQ(due[0].repeated, 59u);
    EXPECT_EQ(due[0].last - due[0].first, 58s);
    EXPECT_FALSE(say(kStart + 61s, "7")) << "it goes on";
    EXPECT_EQ(repeats.take_due(kStart + 2min).size(), 1u);
}

TEST_F(LogRepeatsTest, RepeatsAreLoggedBeforeTheNextEvent) {
    say(kStart, "7");
    say(kStart + 1s, "7");
    EXPECT_TRUE(say(kStart + 2s, "8"));
    const auto ended = repeats.take_ended();
    ASSERT_EQ(ended.size(), 1u);
    EXPECT_EQ(ended[0].line.text, "7");
    EXPECT_TRUE(say(kStart + 3s, "7")) << "7 again is a change";
}

TEST_F(LogRepeatsTest, MorePlacesThanTheLimitLoseNothing) {
    const int places = 3 * static_cast<int>(LogRepeats::kMostPlaces);
    std::uint64_t told = 0;
    for (int i = 0; i < places; ++i) {
        for (int twice = 0; twice < 2; ++twice)
            told += say(kStart + 1ms * i, "7", std::to_string(i)) ? 1 : 0;
    }
    for (const auto& one : repeats.take_due(TimePoint::max())) told += one.repeated;
    EXPECT_EQ(told, 2u * static_cast<unsigned>(places));
}

class LogTest : public ::testing::Test {
  protected:
    ~LogTest() override { set_up_log({}); }
    /// Of many connections from one address.
    static void close_hundred(const std::string& address) {
        for (int port = 50000; port < 50100; ++port)
            log(LogLevel::info, "connection closed",
                {{"listener", "a:502"}, {"client", address + ':' + std::to_string(port)}});
    }
    LogTap tap;
};

TEST_F(LogTest, QuotesInTextOnlyWhatHasToBe) {
    log(LogLevel::info, "line up", {{"line", "floor1"}, {"why", "say \"no\""}, {"empty", ""}});
    EXPECT_THAT(tap.lines(), ElementsAre(R"(info line up line=floor1 why="say \"no\"" empty="")"));
}

TEST_F(LogTest, GivesEachFieldAKeyOfItsOwnInJsonAndSaysNothingBelowItsLevel) {
    set_up_log({LogLevel::warn, LogFormat::json});
    log(LogLevel::info, "line up");
    log(LogLevel::warn, "cannot accept", {{"listener", "127.0.0.1:502"}, {"reason", "a\tb"}});
    EXPECT_THAT(tap.lines(),
                ElementsAre("\"level\":\"warn\",\"event\":\"cannot accept\",\"listener\":"
                            "\"127.0.0.1:502\",\"reason\":\"a\\u0009b\""));
}

TEST_F(LogTest, ThrottlesAClientWhateverItsPort) {
    close_hundred("10.0.0.7");
    close_hundred("[::1]");
    log(LogLevel::info, "connection closed", {{"listener", "a:502"}, {"client", "10.0.0.8:1"}});
    EXPECT_EQ(tap.count("client=10.0.0.7"), 3u);
    EXPECT_EQ(tap.count("client=[::1]"), 3u);
    EXPECT_EQ(tap.count("client=10.0.0.8"), 1u);
    for (int part = 1; part <= 9; ++part)
        log(LogLevel::warn, "login failed",
            {{"listener", "a:80"}, {"client", "2001:db8::" + std::to_string(part) + ":0:0:0:1"}});
    EXPECT_EQ(tap.count("login failed"), 9u) << "none of them is another's port";
    for (int part = 1; part <= 9; ++part)
        log(LogLevel::warn, "login failed",
            {{"listener", "a:80"}, {"client", "2001:db8:7::" + std::to_string(part)}});
    EXPECT_EQ(tap.count("login failed"), 12u) << "a network of 64 bits is one client";
}

TEST_F(LogTest, TopicsThatChangeDoNotFillTheLog) {
    for (int i = 0; i < 1000; ++i)
        log(LogLevel::warn, "mqtt write refused",
            {{"client", "mqtt"}, {"topic", "plant/" + std::to_string(i) + "/set"}, {"why", "odd"}});
    EXPECT_LE(tap.count("mqtt write refused client"), 70u);
}

TEST_F(LogTest, AddressesThatChangeDoNotFillTheLogAndHideNoWrite) {
    for (int i = 0; i < 1000; ++i) {
        const std::string client = "127.0." + std::to_string(i / 250) + '.' + std::to_string(i);
        log(LogLevel::info, "connection closed", {{"listener", "a:502"}, {"client", client}});
        const LogField field{"client", client};
        log_each("write", "press/100", client, {&field, 1});
    }
    EXPECT_GE(tap.count("info connection closed"), 100u);
    EXPECT_LE(tap.count("info connection closed"), 140u);
    EXPECT_EQ(tap.count("info write"), 1000u);
    {
        test::ManualClock clock;
        const LogDrain drain(clock);
    }
    EXPECT_EQ(tap.count("log lines left out of=\"connection closed\" clients=256+ count="), 1u);
}

TEST_F(LogTest, ThrottlesASubjectWithChangingFieldsLikeOneThatRepeats) {
    for (int i = 0; i < 30; ++i) {
        for (const char* state : {"ok", "timeout", "damaged"})
            log_about("a to b", LogLevel::warn, "relay", {{"relay", "a to b"}, {"state", state}});
    }
    log_about("a to c", LogLevel::warn, "relay", {{"relay", "a to c"}, {"state", "ok"}});
    EXPECT_EQ(tap.count("\"a to b\""), 3u);
    EXPECT_EQ(tap.count("\"a to c\""), 1u);
}

}  // namespace
}  // namespace panelgate::rt::log_test
