#include "panelgate/audit/trail.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <string>
#include <vector>

#include "panelgate/audit/verify.hpp"
#include "support/temp_dir.hpp"

namespace panelgate::audit {
namespace {

namespace fs = std::filesystem;

Report verify(const std::string& file) {
    Verifier verifier;
    verifier.begin_file(file);
    std::ifstream in(file, std::ios::binary);
    for (std::string line; std::getline(in, line);) verifier.take(line, true);
    return verifier.finish();
}

/// Notices as they come from the trail's thread.
class Told {
  public:
    Trail::Hooks hooks() {
        return {[this](Notice notice) {
                    const std::scoped_lock lock(mutex_);
                    notices_.push_back(std::move(notice));
                    came_.notify_all();
                },
                [] { return WallTime(); }, R"(,"version":"1.0.0")"};
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
    static std::string body(int i) {
        return R"("time":"T","kind":"write","value":)" + std::to_string(i);
    }

    test::TempDir folder;
    std::string file = (folder.path() / "audit.jsonl").string();
    Told told;
};

TEST_F(AuditTrail, RecordsWhatIsAddedInItsOrder) {
    Trail trail(settings(), told.hooks());
    for (int i = 0; i < 1000; ++i) trail.add(body(i));
    const Trail::End end = trail.close();
    const Position last = end.last;
    EXPECT_EQ(end.unwritten, 0U);
    EXPECT_EQ(last.number, 1002U);
    EXPECT_EQ(trail.counters().records, 1002U);
    EXPECT_EQ(trail.counters().lost, 0U);
    const Report report = verify(file);
    EXPECT_FALSE(report.fault);
    EXPECT_EQ(report.last, last);
}

TEST_F(AuditTrail, NamesItsFirstRecordAsAnAnchor) {
    Trail trail(settings(), told.hooks());
    const Notice anchor = told.wait_for(Notice::Kind::anchor);
    EXPECT_EQ(anchor.at.number, 2U);
    EXPECT_FALSE(trail.is_failing());
    EXPECT_EQ(anchor.text, trail.close().chain);
}

TEST_F(AuditTrail, AFileThatIsRemovedIsSeenWithoutARecord) {
    Trail trail(settings(), told.hooks());
    told.wait_for(Notice::Kind::anchor);
    fs::remove(file);
    EXPECT_NE(told.wait_for(Notice::Kind::failing).text.find("was removed"), std::string::npos);
    told.wait_for(Notice::Kind::recovered);
    EXPECT_EQ(trail.counters().failures, 1U);
}

TEST_F(AuditTrail, WhatCouldNotBeWrittenAtTheEndIsCounted) {
    Settings nowhere = settings();
    nowhere.file = (folder.path() / "no" / "audit.jsonl").string();
    nowhere.buffer = 1000;
    Trail trail(nowhere, told.hooks());
    told.wait_for(Notice::Kind::failing);
    for (int i = 0; i < 200; ++i) trail.add(body(i));
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
    EXPECT_TRUE(trail.is_failing());
    for (int i = 0; i < 200; ++i) trail.add(body(i));
    const std::uint64_t lost = trail.counters().lost;
    EXPECT_GT(lost, 100U);
    fs::create_directory(folder.path() / "no");
    told.wait_for(Notice::Kind::recovered);
    trail.close();
    const Report report = verify(small.file);
    EXPECT_FALSE(report.fault);
    ASSERT_EQ(report.remarks.size(), 1U);
    EXPECT_NE(report.remarks[0].find(std::to_string(lost) + " records were left out"),
              std::string::npos);
    EXPECT_EQ(report.records, 2 + (200 - lost) + 1);
    EXPECT_EQ(trail.counters().failures, 1U);
}

TEST_F(AuditTrail, AnotherFileHasAChainOfItsOwnAndWhatCameBeforeIsInTheFirst) {
    for (const bool waits : {true, false}) {
        Settings first = settings();
        first.file += waits ? ".a" : ".b";
        Trail trail(first, told.hooks());
        if (waits) told.wait_for(Notice::Kind::anchor);
        for (int i = 0; i < 10; ++i) trail.add(body(i));
        Settings other = first;
        other.file += ".other";
        trail.apply(other);
        trail.add(body(10));
        trail.close();
        EXPECT_EQ(verify(first.file).records, 12U);
        const Report report = verify(other.file);
        EXPECT_FALSE(report.fault);
        EXPECT_EQ(report.records, 3U);
        EXPECT_FALSE(verify(first.file).fault);
    }
}

TEST_F(AuditTrail, SyslogGetsEachRecordAsWellAndMayBeAway) {
    const std::string path = (folder.path() / "log").string();
    Settings both = settings();
    both.syslog = true;
    both.syslog_socket = path;
    {
        Trail trail(both, told.hooks());
        trail.add(body(0));
        trail.close();
        EXPECT_EQ(trail.counters().syslog_lost, 3U) << "file, start and the write";
    }
    const int reader = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof(address.sun_path) - 1);
    ASSERT_EQ(::bind(reader, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
    Trail trail(both, told.hooks());
    trail.add(body(7));
    trail.close();
    EXPECT_EQ(trail.counters().syslog_lost, 0U);
    std::vector<std::string> messages;
    std::array<char, 500> text{};
    for (ssize_t got = 0; (got = ::recv(reader, text.data(), text.size(), MSG_DONTWAIT)) > 0;)
        messages.emplace_back(text.data(), static_cast<std::size_t>(got));
    ::close(reader);
    ASSERT_EQ(messages.size(), 2U);
    const std::string own = " panelgate " + std::to_string(::getpid());
    EXPECT_NE(messages[0].find(own + R"( start - {"n":4,)"), std::string::npos) << messages[0];
    EXPECT_TRUE(messages[1].starts_with("<110>1 T ")) << messages[1];
    EXPECT_NE(messages[1].find(own + R"( write - {"n":5,)" + body(7) + R"(,"hash":")"),
              std::string::npos)
        << messages[1];
    EXPECT_FALSE(verify(file).fault);
}

}  // namespace
}  // namespace panelgate::audit
