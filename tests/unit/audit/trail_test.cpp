#include "panelgate/audit/trail.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <string>
#include <vector>

#include "panelgate/audit/verify.hpp"
#include "support/temp_dir.hpp"

namespace panelgate::audit {
namespace {

namespace fs = std::filesystem;

Report verify_file(const std::string& file) { return verify({file}); }

/// Notices as they come from the trail's thread.
class Told {
  public:
    Trail::Hooks hooks() {
        return {[this](Notice notice) {
                    const std::scoped_lock lock(mutex_);
                    notices_.push_back(std::move(notice));
                    came_.notify_all();
                },
                [] { return WallTime(); },
                {{"version", "1.0.0"}}};
    }
    /// Waits until one of this kind has come.
    Notice wait_for(Notice::Kind kind) {
        std::unique_lock lock(mutex_);
        const auto found = [&] {
            return std::ranges::find(notices_, kind, &Notice::kind) != notices_.end();
        };
        EXPECT_TRUE(came_.wait_for(lock, 30s, found));
        const auto notice = std::ranges::find(notices_, kind, &Notice::kind);
        return notice == notices_.end() ? Notice{} : *notice;
    }

  private:
    std::mutex mutex_;
    std::condition_variable came_;
    std::vector<Notice> notices_;
};

class AuditTrail : public testing::Test {
  protected:
    Settings settings() const {
        Settings settings;
        settings.file = file;
        settings.flush = 5ms;
        return settings;
    }
    static Members record(int i) { return {{"time", "T"}, {"kind", "write"}, {"value", i}}; }

    test::TempDir folder;
    std::string file = (folder.path() / "audit.jsonl").string();
    Told told;
};

TEST_F(AuditTrail, RecordsWhatIsAddedInItsOrder) {
    Trail trail(settings(), told.hooks());
    for (int i = 0; i < 1000; ++i) trail.add(record(i));
    const Trail::End end = trail.close();
    const Position last = end.last;
    EXPECT_EQ(end.unwritten, 0U);
    EXPECT_EQ(last.number, 1002U);
    EXPECT_EQ(trail.counters().records, 1002U);
    EXPECT_EQ(trail.counters().lost, 0U);
    const Report report = verify_file(file);
    EXPECT_FALSE(report.fault);
    EXPECT_EQ(report.last, last);
}

TEST_F(AuditTrail, NamesItsFirstRecordAsAnAnchor) {
    Trail trail(settings(), told.hooks());
    const Notice anchor = told.wait_for(Notice::Kind::anchor);
    EXPECT_EQ(anchor.at.number, 2U);
    EXPECT_FALSE(trail.counters().failing);
    EXPECT_EQ(anchor.text, trail.close().chain);
}

TEST_F(AuditTrail, AFileThatIsRemovedIsSeenWithoutARecord) {
    Trail trail(settings(), told.hooks());
    told.wait_for(Notice::Kind::anchor);
    fs::remove(file);
    EXPECT_NE(told.wait_for(Notice::Kind::remark).text.find("was removed"), std::string::npos);
    trail.close();
    EXPECT_EQ(trail.counters().failures, 0U);
    const Report report = verify_file(file);
    ASSERT_TRUE(report.fault);
    EXPECT_EQ(report.fault->kind, "removed");
}

TEST_F(AuditTrail, WhatCouldNotBeWrittenAtTheEndIsCounted) {
    Settings nowhere = settings();
    nowhere.file = (folder.path() / "no" / "audit.jsonl").string();
    nowhere.buffer = 1000;
    Trail trail(nowhere, told.hooks());
    told.wait_for(Notice::Kind::failing);
    for (int i = 0; i < 200; ++i) trail.add(record(i));
    const Trail::End end = trail.close();
    EXPECT_EQ(end.last.number, 0U);
    EXPECT_EQ(end.unwritten, 200U);
}

TEST_F(AuditTrail, WhatFindsNoRoomIsCountedAndTheCountIsRecorded) {
    Settings small = settings();
    small.file = (folder.path() / "no" / "audit.jsonl").string();
    small.buffer = 1000;
    Trail trail(small, told.hooks());
    EXPECT_NE(told.wait_for(Notice::Kind::failing).text.find("No such file"), std::string::npos);
    EXPECT_TRUE(trail.counters().failing);
    for (int i = 0; i < 200; ++i) trail.add(record(i));
    const std::uint64_t lost = trail.counters().lost;
    EXPECT_GT(lost, 100U);
    fs::create_directory(folder.path() / "no");
    told.wait_for(Notice::Kind::recovered);
    trail.close();
    const Report report = verify_file(small.file);
    EXPECT_FALSE(report.fault);
    ASSERT_EQ(report.remarks.size(), 1U);
    EXPECT_TRUE(report.remarks[0].ends_with("took nothing: " + std::to_string(lost)));
    EXPECT_EQ(report.records, 2 + (200 - lost) + 1);
    EXPECT_EQ(trail.counters().failures, 1U);
}

}  // namespace
}  // namespace panelgate::audit
