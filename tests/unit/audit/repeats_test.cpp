#include "panelgate/audit/repeats.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace panelgate::audit {
namespace {

const TimePoint kStart{};

bool note(Repeats& repeats, Duration after, const std::string& key, unsigned in_full = 1) {
    const auto wall = WallTime(std::chrono::duration_cast<std::chrono::microseconds>(after));
    return repeats.is_new(kStart + after, wall, key, in_full,
                          [&] { return ",\"client\":\"" + key + '"'; });
}

TEST(AuditRepeats, TheFirstIsRecordedAndTheRestIsCountedSoonAndThenOnceInAnInterval) {
    Repeats repeats;
    EXPECT_TRUE(note(repeats, 0s, "a"));
    EXPECT_TRUE(note(repeats, 0s, "b"));
    std::vector<int> recorded;
    std::uint64_t count = 0;
    for (int i = 1; i <= 300; ++i) {
        EXPECT_FALSE(note(repeats, i * 1s, "a"));
        for (const auto& counted : repeats.due(kStart + i * 1s)) {
            EXPECT_EQ(counted.members, R"(,"client":"a")");
            EXPECT_EQ(counted.last, WallTime(std::chrono::seconds(i)));
            count += counted.count;
            recorded.push_back(i);
        }
    }
    EXPECT_EQ(recorded, (std::vector{1, 3, 7, 15, 31, 63, 123, 183, 243}));
    EXPECT_EQ(count, 243U);
}

TEST(AuditRepeats, OneThatGoesOnIsCountedOnAndOneThatHasEndedBeginsAnew) {
    Repeats repeats;
    note(repeats, 0s, "a");
    note(repeats, 1s, "a");
    EXPECT_EQ(repeats.due(kStart + 60s).size(), 1U);
    EXPECT_FALSE(note(repeats, 61s, "a"));
    EXPECT_EQ(repeats.due(kStart + 120s).size(), 1U);
    EXPECT_TRUE(repeats.due(kStart + 180s).empty());
    EXPECT_TRUE(repeats.empty());
    EXPECT_TRUE(note(repeats, 181s, "a"));
}

TEST(AuditRepeats, SomeMayBeRecordedInFull) {
    Repeats repeats;
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(note(repeats, 0s, "a", 3));
    EXPECT_FALSE(note(repeats, 0s, "a", 3));
    ASSERT_EQ(repeats.due(kStart + 1s, true).size(), 1U);
}

TEST(AuditRepeats, PlacesOfOneClientShareARecordAtLast) {
    Repeats repeats;
    const Repeats::Client client{"eve\t", [] { return std::string(R"(,"client":"eve")"); }};
    const auto try_at = [&](const std::string& place) {
        return repeats.is_new(kStart, {}, "eve\t" + place, 1, [] { return std::string(); }, client);
    };
    for (std::size_t i = 0; i < Repeats::kMostOfOne; ++i) EXPECT_TRUE(try_at(std::to_string(i)));
    EXPECT_FALSE(try_at("x"));
    EXPECT_FALSE(try_at("y"));
    EXPECT_TRUE(note(repeats, 0s, "adam"));
    const auto due = repeats.due(kStart, true);
    ASSERT_EQ(due.size(), 1U);
    EXPECT_EQ(due[0].count, 2U);
    EXPECT_EQ(due[0].members, R"(,"client":"eve","at":"other places")");
}

TEST(AuditRepeats, ManyClientsShareAPlaceAtLastAndRoomComesBackSlowly) {
    Repeats repeats;
    for (int i = 0; i < Repeats::kNewAtOnce; ++i) EXPECT_TRUE(note(repeats, 0s, std::to_string(i)));
    EXPECT_TRUE(note(repeats, 0s, "x"));
    for (int i = 0; i < 100; ++i) EXPECT_FALSE(note(repeats, 0s, "y" + std::to_string(i)));
    const auto due = repeats.due(kStart, true);
    ASSERT_EQ(due.size(), 1U);
    EXPECT_EQ(due[0].count, 100U);
    EXPECT_EQ(due[0].members, R"(,"client":"others")");
    int in_full = 0;
    for (int i = 0; i < 600; ++i) in_full += note(repeats, i * 1s, "z" + std::to_string(i)) ? 1 : 0;
    EXPECT_EQ(in_full, 600 / 5 - 1);
}

}  // namespace
}  // namespace panelgate::audit
