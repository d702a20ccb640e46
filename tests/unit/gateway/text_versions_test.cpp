#include "panelgate/gateway/text_versions.hpp"

#include <gmock/gmock.h>

#include <chrono>
#include <string>

#include "panelgate/rt/clock.hpp"

namespace panelgate::gateway::text_versions_test {
namespace {

using ::testing::Each;
using ::testing::Field;
using ::testing::SizeIs;

const WallTime kNow{std::chrono::microseconds(1'700'000'000'123'456)};

TEST(TextVersions, KeepTheLastTenThatDiffer) {
    TextVersions versions;
    versions.restore({}, nullptr);
    for (int i = 1; i <= 12; ++i) {
        versions.add("text " + std::to_string(i), "ops", kNow);
        versions.add("text " + std::to_string(i), "again", kNow);
    }
    const auto list = versions.list();
    ASSERT_THAT(list, SizeIs(TextVersions::kMost));
    EXPECT_EQ(list.front().version, 12U);
    EXPECT_EQ(list.back().version, 3U);
    EXPECT_THAT(list, Each(Field(&web::TextVersion::who, "ops")));
    EXPECT_EQ(versions.text(3), "text 3");
    EXPECT_EQ(versions.text(2), std::nullopt);
}

TEST(TextVersions, GoOnBehindThoseOfAFormerProgram) {
    TextVersions::Records store;
    const auto keep = [&](const std::string& key, const std::string& record) {
        store.emplace_back(key, record);
    };
    TextVersions former;
    former.restore({}, keep);
    former.add("lines:\n  - a\n", "http 10.0.0.9 token \"ops\"\n", kNow);
    ASSERT_THAT(store, SizeIs(1));
    EXPECT_TRUE(store[0].first.starts_with(TextVersions::kPrefix));
    store.emplace_back("configuration/7", "damaged");

    TextVersions versions;
    versions.add("lines:\n  - a\n", "start", kNow);
    versions.restore(TextVersions::Records(store), keep);
    ASSERT_THAT(versions.list(), SizeIs(1)) << "the same text runs on";
    EXPECT_EQ(versions.list()[0].who, "http 10.0.0.9 token \"ops\"\n");
    EXPECT_EQ(versions.list()[0].time, kNow);
    EXPECT_EQ(versions.text(1), "lines:\n  - a\n");
    versions.add("lines: []\n", "start", kNow);
    EXPECT_EQ(versions.list()[0].version, 2U);
    EXPECT_THAT(store, SizeIs(3)) << "a new text is kept at once";
}

TEST(TextVersions, ATextThatRanBeforeTheStoreAnsweredIsKept) {
    TextVersions versions;
    versions.add("lines: []\n", "start", kNow);
    EXPECT_THAT(versions.list(), SizeIs(0)) << "its number is not known";
    std::size_t kept = 0;
    versions.restore({}, [&](const std::string&, const std::string&) { ++kept; });
    EXPECT_EQ(kept, 1U);
    EXPECT_EQ(versions.list()[0].version, 1U);
}

}  // namespace
}  // namespace panelgate::gateway::text_versions_test
