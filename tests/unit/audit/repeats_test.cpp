#include "panelgate/audit/repeats.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace panelgate::audit {
namespace {

const TimePoint kStart{};

/// True if the attempt is recorded in full.
bool note(Repeats& repeats, Duration after, const std::string& client,
          const std::string& what = "x") {
    const auto wall = WallTime(std::chrono::duration_cast<std::chrono::microseconds>(after));
    return repeats.is_new(kStart + after, wall, {{"client", client}}, {{"at", what}});
}

std::vector<std::string> texts(const std::vector<Members>& records) {
    std::vector<std::string> all;
    for (const Members& record : records) all.push_back(body_of(record));
    return all;
}

using Texts = std::vector<std::string>;

TEST(AuditRepeats, TheFirstIsRecordedAndTheRestIsCountedOnceInAMinute) {
    Repeats repeats;
    EXPECT_TRUE(note(repeats, 0s, "a"));
    EXPECT_TRUE(note(repeats, 0s, "b"));
    for (int i = 1; i < 60; ++i) {
        EXPECT_FALSE(note(repeats, i * 1s, "a"));
        EXPECT_TRUE(repeats.due(kStart + i * 1s).empty());
    }
    EXPECT_EQ(texts(repeats.due(kStart + 60s)),
              Texts{R"("count":59,"first":"1970-01-01T00:00:01.000Z",)"
                    R"("last":"1970-01-01T00:00:59.000Z","client":"a","at":"x")"});
    EXPECT_TRUE(note(repeats, 61s, "b")) << "the minute without one has ended";
    EXPECT_FALSE(note(repeats, 61s, "a")) << "still the same row of attempts";
    EXPECT_EQ(repeats.due(kStart + 62s, true).size(), 1U) << "at the end at once";
    repeats.due(kStart + 200s);
    EXPECT_TRUE(repeats.empty());
}

TEST(AuditRepeats, ManyPlacesOfAClientShareOneAndSoDoManyClients) {
    Repeats repeats;
    for (std::size_t i = 0; i < 2 * Repeats::kMostOfOne; ++i)
        EXPECT_EQ(note(repeats, 0s, "eve", std::to_string(i)), i < Repeats::kMostOfOne);
    EXPECT_EQ(texts(repeats.due(kStart, true)),
              Texts{R"("count":64,"first":"1970-01-01T00:00:00.000Z",)"
                    R"("last":"1970-01-01T00:00:00.000Z","client":"eve","at":"other places")"});
    for (std::size_t i = 1; i < 2 * Repeats::kClients; ++i)
        EXPECT_EQ(note(repeats, 0s, std::to_string(i)), i < Repeats::kClients);
    const std::vector<Members> due = repeats.due(kStart, true);
    ASSERT_EQ(due.size(), 1U);
    EXPECT_EQ(due[0].at("client"), "others");
    EXPECT_EQ(due[0].at("count"), 64);
}

}  // namespace
}  // namespace panelgate::audit
