#include "panelgate/store/database.hpp"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <filesystem>
#include <fstream>
#include <future>
#include <string>

#include "panelgate/store/store.hpp"
#include "support/temp_dir.hpp"

namespace panelgate::store {
namespace {

constexpr WallTime kNoon{std::chrono::seconds(1'795'953'600)};

class StoreTest : public testing::Test {
  protected:
    StoreTest() { settings.file = folder / "state.db"; }

    static Entry entry(int minute, Kind kind = Kind::write, std::string station = "press") {
        Entry entry;
        entry.time = kNoon + std::chrono::minutes(minute);
        entry.kind = kind;
        entry.station = std::move(station);
        entry.text = "at " + std::to_string(minute);
        return entry;
    }

    const test::TempDir temporary;
    const std::filesystem::path folder = temporary.path();
    Settings settings;
};

TEST(Block, KeepsIntegersAsTheyAre) {
    Block block;
    block.add(kNoon, 123'456'789);
    block.add(kNoon + std::chrono::seconds(299), 0.1F);
    const auto back = Block::parse(block.bytes());
    ASSERT_TRUE(back);
    EXPECT_EQ(back->slots(), block.slots());
    EXPECT_EQ(block.bytes().size(), 720U);
    EXPECT_EQ(Block().bytes().size(), 360U);
    EXPECT_FALSE(Block::parse("short"));
}

TEST(Block, ASlotHoldsLeastGreatestAndMean) {
    Block block;
    for (const double value : {1.0, 2.0, 6.0}) block.add(kNoon + std::chrono::seconds(11), value);
    EXPECT_EQ(block.slots()[1], (Summary{1, 6, 3, 3}));
    EXPECT_EQ(block.slots()[0].count, 0U);
    EXPECT_EQ(Block::begin_of(Block::number_of(kNoon)), kNoon);
}

TEST_F(StoreTest, TheJournalIsReadPageByPageTheNewestFirst) {
    Database database(settings);
    for (int i = 0; i < 5; ++i) database.add(entry(i));
    database.add(entry(9, Kind::line_down, ""));
    JournalQuery query;
    query.kinds = {Kind::write};
    query.limit = 2;
    std::string seen;
    do {
        const JournalPage page = database.journal(query);
        for (const Entry& one : page.entries) seen += one.text + ' ';
        query.after = page.next;
    } while (query.after != 0);
    EXPECT_EQ(seen, "at 4 at 3 at 2 at 1 at 0 ");
    query.since = kNoon + std::chrono::minutes(2);
    query.until = kNoon + std::chrono::minutes(4);
    EXPECT_EQ(database.journal(query).entries.size(), 2U);
    query.may_see = [](const Entry& one) { return one.text != "at 3"; };
    EXPECT_EQ(database.journal(query).entries.size(), 1U);
}

TEST_F(StoreTest, AStepOfHistoryJoinsItsSlotsAndBlocksOfTwoRuns) {
    for (int run = 0; run < 2; ++run) {
        Database database(settings);
        Block block;
        for (int i = 0; i < 15; ++i)
            block.add(kNoon + (2 * i + run) * Block::kSlot, run == 0 ? 10 : 30);
        database.add("press/temperature", Block::number_of(kNoon), block);
    }
    const Database database(settings);
    const auto samples = database.history(
        {"press/temperature", kNoon, kNoon + std::chrono::hours(1), std::chrono::seconds(60)});
    ASSERT_EQ(samples.size(), 5U) << "steps without a value are left out";
    EXPECT_EQ(samples[1].time, kNoon + std::chrono::seconds(60));
    EXPECT_EQ(samples[1].values, (Summary{10, 30, 20, 6}));
    EXPECT_TRUE(database.history({"press/other", kNoon, kNoon + std::chrono::hours(1)}).empty());
}

TEST_F(StoreTest, HistoryOfAFarFutureEndsWithTheNewestBlock) {
    Database database(settings);
    Block block;
    block.add(kNoon, 10);
    database.add("press/temperature", Block::number_of(kNoon), block);
    const auto samples = database.history(
        {"press/temperature", kNoon, kNoon + std::chrono::days(200'000), std::chrono::days(1)});
    ASSERT_EQ(samples.size(), 1U);
    EXPECT_EQ(samples[0].values.mean, 10);
}

TEST_F(StoreTest, WhatIsOldGoesAndTheFileStaysWithinItsSize) {
    settings.size = 1150 * 1024;
    Database database(settings);
    for (int day = 0; day < 40; ++day)
        for (int i = 0; i < 20; ++i) {
            Entry one = entry(day * 24 * 60 + i);
            one.data.assign(1100, 'x');
            database.add(one);
        }
    database.prune(kNoon + std::chrono::days(30));
    const auto count = [&] { return database.journal({.limit = 1000}).entries.size(); };
    EXPECT_LT(count(), 800U) << "the file was nearly full";
    EXPECT_GT(count(), 600U);
    EXPECT_LE(database.bytes(), settings.size);
    database.prune(kNoon + std::chrono::days(40));
    const auto left = database.journal({.limit = 1000}).entries;
    EXPECT_EQ(left.back().time, kNoon + std::chrono::days(10)) << "older than 30 days";
}

TEST_F(StoreTest, ADamagedFileIsSetAside) {
    {
        Database database(settings);
        for (int i = 0; i < 500; ++i) database.add(entry(i));
    }
    {
        std::fstream file(settings.file, std::ios::in | std::ios::out | std::ios::binary);
        file.seekp(8192);
        file << std::string(8000, '\x5A');
    }
    Database database(settings);
    EXPECT_TRUE(database.journal({}).entries.empty());
    EXPECT_NE(database.remark().find(".damaged, and a new one begins"), std::string::npos)
        << database.remark();
    EXPECT_TRUE(std::filesystem::exists(settings.file + ".damaged"));
    database.add(entry(1));
}

TEST_F(StoreTest, AFileOfANewerProgramIsLeftAlone) {
    {
        const Database database(settings);
    }
    sqlite3* raw = nullptr;
    sqlite3_open(settings.file.c_str(), &raw);
    sqlite3_exec(raw, "PRAGMA user_version = 99", nullptr, nullptr, nullptr);
    sqlite3_close(raw);
    EXPECT_THROW(Database{settings}, std::runtime_error);
    EXPECT_FALSE(std::filesystem::exists(settings.file + ".damaged"));
}

TEST_F(StoreTest, TextsAreKeptByKey) {
    Database database(settings);
    database.keep("alarm/a", "1");
    database.keep("alarm/b", "2");
    database.keep("outbox/1", "3");
    database.keep("alarm/a", "");
    using Kept = std::vector<std::pair<std::string, std::string>>;
    EXPECT_EQ(database.kept("alarm/"), (Kept{{"alarm/b", "2"}}));
}

TEST_F(StoreTest, AThreadWritesAndAReadComesBehindTheWrites) {
    Store store(settings, [] { return kNoon; }, [](bool, const std::string&) {});
    for (int i = 0; i < 10; ++i) store.put([i](Database& to) { to.add(entry(i)); });
    std::promise<std::size_t> found;
    store.ask([&](Database* from) { found.set_value(from->journal({}).entries.size()); });
    EXPECT_EQ(found.get_future().get(), 10U);
    EXPECT_EQ(store.counters().written, 10U);
    EXPECT_FALSE(store.counters().failing);
}

TEST_F(StoreTest, AQueueThatIsFullLosesWritesAndCountsThem) {
    settings.queue = 3;
    std::promise<void> busy;
    std::promise<void> go_on;
    Store store(settings, [] { return kNoon; }, [](bool, const std::string&) {});
    store.ask([&](Database*) {
        busy.set_value();
        go_on.get_future().wait();
    });
    busy.get_future().wait();
    for (int i = 0; i < 5; ++i) store.put([i](Database& to) { to.add(entry(i)); });
    EXPECT_EQ(store.counters().waiting, 3U);
    EXPECT_EQ(store.counters().lost, 2U);
    go_on.set_value();
}

TEST_F(StoreTest, AFolderThatIsMissingIsToldAndReadsHaveNoDatabase) {
    settings.file = folder / "none" / "state.db";
    std::promise<std::string> told;
    Store store(
        settings, [] { return kNoon; },
        [&](bool failing, const std::string& why) {
            if (failing) told.set_value(why);
        });
    store.put([](Database& to) { to.add(entry(1)); });
    std::promise<bool> has_none;
    store.ask([&](Database* from) { has_none.set_value(from == nullptr); });
    EXPECT_TRUE(has_none.get_future().get());
    EXPECT_NE(told.get_future().get().find("unable to open database file"), std::string::npos);
    EXPECT_EQ(store.counters().lost, 1U);
}

TEST_F(StoreTest, AFullFileLosesWhatComesUntilOldEntriesHaveGone) {
    settings.size = 256 * 1024;
    std::atomic<int> failures = 0;
    {
        Store store(
            settings, [] { return kNoon; },
            [&](bool failing, const std::string&) { failures += failing ? 1 : 0; });
        for (int i = 0; i < 600; ++i)
            store.put([i](Database& to) {
                Entry one = entry(i * 60);
                one.data.assign(1000, 'x');
                to.add(one);
            });
        std::promise<void> done;
        store.ask([&](Database*) { done.set_value(); });
        done.get_future().wait();
        EXPECT_EQ(store.counters().lost, 600U) << "one transaction";
        EXPECT_TRUE(store.counters().failing);
        store.put([](Database& to) { to.add(entry(1)); });
    }
    EXPECT_EQ(failures, 1);
    EXPECT_EQ(Database(settings).journal({}).entries.size(), 1U);
}

}  // namespace
}  // namespace panelgate::store
