#include "panelgate/audit/writer.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "panelgate/audit/files.hpp"
#include "panelgate/audit/verify.hpp"
#include "support/temp_dir.hpp"

namespace panelgate::audit {
namespace {

namespace fs = std::filesystem;

std::string read(const std::string& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<std::string> lines_of(const std::string& file) {
    std::ifstream in(file, std::ios::binary);
    std::vector<std::string> lines;
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
}

class AuditWriter : public testing::Test {
  protected:
    Settings settings() const {
        Settings settings;
        settings.file = file;
        return settings;
    }
    std::unique_ptr<Writer> make(const Settings& settings) const {
        return std::make_unique<Writer>(
            settings, [] { return WallTime(); }, Members{{"version", "1.0.0"}});
    }
    static std::string body(int i) {
        return R"("time":"T","kind":"write","value":)" + std::to_string(i);
    }
    /// Writes the numbers [from, to), which may be none.
    static bool write(Writer& writer, int from = 0, int to = 0) {
        std::string bodies;
        for (int i = from; i < to; ++i) bodies += body(i) + '\n';
        return writer.write(bodies);
    }
    /// Writes the numbers [0, count), one after the other.
    static bool write_each(Writer& writer, int count) {
        bool good = true;
        for (int i = 0; i < count; ++i) good = write(writer, i, i + 1) && good;
        return good;
    }
    static bool end(Writer& writer) {
        std::string bodies = body(1) + "\n\"time\":\"T\",\"kind\":\"end\"\n";
        return writer.write(bodies);
    }
    std::vector<std::string> files() const {
        std::vector<std::string> all;
        for (const auto& entry : fs::directory_iterator(folder.path()))
            all.push_back(entry.path().string());
        std::ranges::sort(all, {}, first_record);
        return all;
    }
    /// As the files of the configuration.
    Report verify_all() const {
        std::vector<std::string> all = rotated_files(file);
        all.push_back(file);
        return verify(all, {}, file);
    }

    test::TempDir folder;
    std::string file = (folder.path() / "audit.jsonl").string();
};

TEST_F(AuditWriter, BeginsAFileWithWhatItFollowsAndARunWithItsStart) {
    const auto writer = make(settings());
    ASSERT_TRUE(write(*writer, 1, 3)) << writer->why();
    const auto lines = lines_of(file);
    ASSERT_EQ(lines.size(), 4U);
    EXPECT_NE(lines[0].find(R"("kind":"file","previous":"0000)"), std::string::npos);
    EXPECT_NE(lines[1].find(R"("kind":"start","version":"1.0.0")"), std::string::npos);
    EXPECT_NE(lines[3].find(R"("value":2)"), std::string::npos);
    EXPECT_EQ(writer->last().number, 4U);
    EXPECT_EQ(writer->records(), 4U);
    EXPECT_FALSE(verify({file}).fault);
}

TEST_F(AuditWriter, GoesOnWithNumberAndChainAfterARestart) {
    ASSERT_TRUE(write(*make(settings()), 1, 3));
    const auto writer = make(settings());
    ASSERT_TRUE(write(*writer, 3, 5));
    EXPECT_EQ(writer->last().number, 7U);
    const Report report = verify({file});
    EXPECT_FALSE(report.fault);
    EXPECT_EQ(report.records, 7U);
    ASSERT_EQ(report.remarks.size(), 1U);  // no record `end`
    EXPECT_NE(report.remarks[0].find("did not end in order"), std::string::npos);
}

TEST_F(AuditWriter, ARunThatEndedInOrderIsNotCalledOtherwise) {
    const auto first = make(settings());
    ASSERT_TRUE(end(*first));
    const auto second = make(settings());
    EXPECT_FALSE(write(*second)) << "the first one still holds the file";
    EXPECT_EQ(second->why(), "another process writes to " + file);
}

TEST_F(AuditWriter, AfterAnEndInOrderNothingIsMissing) {
    ASSERT_TRUE(end(*make(settings())));
    ASSERT_TRUE(write(*make(settings())));
    const Report report = verify({file});
    EXPECT_FALSE(report.fault);
    EXPECT_TRUE(report.remarks.empty());
}

TEST_F(AuditWriter, ATornLineIsCutOffAndQuoted) {
    ASSERT_TRUE(write(*make(settings()), 1, 3));
    const std::string torn = R"({"n":5,"time":"T","ki)";
    std::ofstream(file, std::ios::app) << torn;
    ASSERT_TRUE(write(*make(settings())));
    const auto lines = lines_of(file);
    ASSERT_EQ(lines.size(), 5U);
    EXPECT_NE(lines[4].find(R"("kind":"start","unclean":true,"torn_bytes":21,)"
                            R"("torn":"{\"n\":5,\"time\":\"T\",\"ki","version")"),
              std::string::npos)
        << lines[4];
    EXPECT_FALSE(verify({file}).fault);
}

TEST_F(AuditWriter, AFileThatIsOnlyATornLineBeginsAnew) {
    std::ofstream(file) << R"({"n":1)";
    ASSERT_TRUE(write(*make(settings())));
    EXPECT_EQ(lines_of(file).size(), 2U);
    EXPECT_FALSE(verify({file}).fault);
}

TEST_F(AuditWriter, TheChainGoesOnOverItsFilesAndTheOldestGo) {
    Settings small = settings();
    small.rotate = 2000;
    small.keep = 3;
    for (int run = 0; run < 4; ++run) {
        const auto writer = make(small);
        ASSERT_TRUE(write_each(*writer, 40)) << writer->why();
        EXPECT_GE(writer->rotations(), 2U);
    }
    const auto all = files();
    EXPECT_EQ(all.size(), 4U);
    EXPECT_EQ(all.back(), file);
    const Report report = verify(all);
    EXPECT_FALSE(report.fault) << report.fault->text;
    EXPECT_GT(report.first, 1U);
    EXPECT_EQ(all[0], rotated_name(file, report.first));
    for (const std::string& one : all) EXPECT_LT(fs::file_size(one), 2400U);
}

TEST_F(AuditWriter, AMissingFileIsFollowedFromTheNewestOneBeforeIt) {
    ASSERT_TRUE(write(*make(settings()), 1, 3));
    fs::rename(file, rotated_name(file, 1));
    ASSERT_TRUE(write(*make(settings())));
    const auto lines = lines_of(file);
    ASSERT_EQ(lines.size(), 2U);
    EXPECT_EQ(lines[0].substr(0, 7), R"({"n":5,)");
    EXPECT_FALSE(verify(files()).fault);
}

TEST_F(AuditWriter, AnotherRotationMayTakeTheFileAway) {
    const auto writer = make(settings());
    ASSERT_TRUE(write(*writer, 1, 3));
    fs::rename(file, (folder.path() / "elsewhere").string());
    ASSERT_TRUE(write(*writer, 3, 5));
    EXPECT_EQ(lines_of(file).size(), 3U);
    EXPECT_FALSE(verify(files()).fault);
    EXPECT_EQ(writer->remark(),
              file +
                  " was removed or moved away while it was written, with the records "
                  "1 to 4, and a new one begins");
}

TEST_F(AuditWriter, AFileThatWasRemovedIsToldByTheNextOne) {
    const auto writer = make(settings());
    ASSERT_TRUE(write(*writer, 1, 3));
    fs::remove(file);
    ASSERT_TRUE(write(*writer, 5, 6));
    EXPECT_NE(writer->remark().find("was removed"), std::string::npos);
    const auto lines = lines_of(file);
    ASSERT_EQ(lines.size(), 2U);
    EXPECT_NE(lines[0].find(R"(,"from":1,"gone":1,)"), std::string::npos) << lines[0];
    const Report report = verify_all();
    ASSERT_TRUE(report.fault);
    EXPECT_EQ(report.fault->kind, "removed");
}

TEST_F(AuditWriter, WhatRotationDropsIsNotCalledRemovedAndWhatIsRemovedIs) {
    Settings small = settings();
    small.rotate = 1000;
    small.keep = 2;
    const auto writer = make(small);
    for (int i = 0; i < 60; ++i) ASSERT_TRUE(write(*writer, i, i + 1));
    const Report report = verify_all();
    EXPECT_FALSE(report.fault) << report.fault->text;
    EXPECT_GT(report.first, 1U);
    EXPECT_EQ(report.chain.size(), 16U);
    fs::remove(files()[0]);
    const Report less = verify_all();
    ASSERT_TRUE(less.fault);
    EXPECT_EQ(less.fault->kind, "removed");
}

TEST_F(AuditWriter, AFileThatOthersChangeIsKeptAndAnotherOneFollows) {
    for (const bool longer : {false, true}) {
        const auto writer = make(settings());
        ASSERT_TRUE(write(*writer, 1, 3));
        const auto size = fs::file_size(file);
        if (longer)
            std::ofstream(file, std::ios::app) << "something else\n";
        else
            fs::resize_file(file, size / 2);
        ASSERT_TRUE(write(*writer, 5, 6));
        const std::string remark = writer->remark();
        EXPECT_NE(remark.find(" was changed by another program while it was written, with "),
                  std::string::npos);
        EXPECT_NE(remark.find(" is kept as " + file + ".aside"), std::string::npos) << remark;
        EXPECT_NE(lines_of(file).at(0).find("\"gone\":"), std::string::npos);
        fs::remove(file);
    }
}

TEST_F(AuditWriter, WhatCannotBeContinuedIsKeptUnderAnotherName) {
    std::ofstream(file) << "something else\n";
    const auto writer = make(settings());
    ASSERT_TRUE(write(*writer, 1, 2));
    EXPECT_NE(writer->remark().find("is kept as " + file + ".aside"), std::string::npos);
    EXPECT_EQ(read(file + ".aside"), "something else\n");
    EXPECT_FALSE(verify({file}).fault);
}

TEST_F(AuditWriter, ATextWithoutANewlineIsKeptTooAndOnlyATornRecordIsCutOff) {
    std::ofstream(file) << "a token";
    ASSERT_TRUE(write(*make(settings()), 1, 2));
    EXPECT_EQ(read(file + ".aside"), "a token");
    for (const char* torn : {R"({"n":1,"time":"T","ki)", "{\"n"}) {
        std::ofstream(file) << torn;
        const auto writer = make(settings());
        ASSERT_TRUE(write(*writer, 1, 2));
        EXPECT_EQ(writer->remark(), "") << torn;
        EXPECT_FALSE(verify({file}).fault);
    }
}

/// Limits what files of this process may become, as a full disk would.
class FullDisk {
  public:
    explicit FullDisk(rlim_t bytes) {
        ::getrlimit(RLIMIT_FSIZE, &before_);
        handler_ = std::signal(SIGXFSZ, SIG_IGN);
        rlimit less = before_;
        less.rlim_cur = bytes;
        ::setrlimit(RLIMIT_FSIZE, &less);
    }
    ~FullDisk() {
        ::setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, handler_);
    }
    FullDisk(const FullDisk&) = delete;
    FullDisk& operator=(const FullDisk&) = delete;

  private:
    rlimit before_{};
    void (*handler_)(int) = nullptr;
};

TEST_F(AuditWriter, AFullDiskTakesABatchWholeOrNotAtAll) {
    const auto writer = make(settings());
    ASSERT_TRUE(write(*writer));
    const auto size = fs::file_size(file);
    std::string bodies = body(1) + '\n' + body(2) + '\n';
    {
        const FullDisk full(size + 50);  // in the middle of a line
        EXPECT_FALSE(writer->write(bodies));
        EXPECT_EQ(writer->why(), "cannot write " + file + ": File too large");
        EXPECT_FALSE(writer->write(bodies));
        EXPECT_EQ(writer->last().number, 2U);
        EXPECT_EQ(fs::file_size(file), size);
    }
    EXPECT_TRUE(writer->write(bodies));
    EXPECT_EQ(bodies, "");
    const Report report = verify({file});
    EXPECT_FALSE(report.fault);
    EXPECT_EQ(report.records, 4U);
}

TEST_F(AuditWriter, ARotationThatIsCutOffHasDroppedNothingYet) {
    Settings small = settings();
    small.rotate = 1000;
    small.keep = 1;
    const auto writer = make(small);
    for (int i = 0; writer->rotations() < 2 || fs::file_size(file) < small.rotate; ++i)
        ASSERT_TRUE(write(*writer, i, i + 1));
    {
        const FullDisk full(0);  // the new file stays empty, as it does where the power is cut
        EXPECT_FALSE(write(*writer, 200, 201));
    }
    ASSERT_EQ(writer->rotations(), 3U);
    ASSERT_EQ(fs::file_size(file), 0U);
    const Report cut = verify_all();
    EXPECT_FALSE(cut.fault) << cut.fault->text;
    ASSERT_TRUE(write(*writer));
    EXPECT_FALSE(verify_all().fault);
}

TEST_F(AuditWriter, SaysWhyAFileCannotBeOpened) {
    Settings nowhere = settings();
    nowhere.file = (folder.path() / "no" / "audit.jsonl").string();
    const auto writer = make(nowhere);
    EXPECT_FALSE(write(*writer, 1, 2));
    EXPECT_EQ(writer->why(), "cannot open " + nowhere.file + ": No such file or directory");
    fs::create_directory(folder.path() / "no");
    EXPECT_TRUE(write(*writer));
    EXPECT_EQ(lines_of(nowhere.file).size(), 2U);
    Settings device = settings();
    device.file = "/dev/null";
    const auto other = make(device);
    EXPECT_FALSE(write(*other));
    EXPECT_EQ(other->why(), "/dev/null is no regular file");
}

}  // namespace
}  // namespace panelgate::audit
