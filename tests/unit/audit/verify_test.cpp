#include "panelgate/audit/verify.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "support/temp_dir.hpp"

namespace panelgate::audit {
namespace {

using Lines = std::vector<std::string>;

std::string body_of(std::size_t i) {
    return R"("time":"2026-11-26T09:00:00.000Z","kind":"write","station":"press","values":[)" +
           std::to_string(i) + "]";
}

/// A chain of `count` writes, the first of them the beginning of a file.
Lines chain_of(std::size_t count, Chain& chain) {
    Lines lines;
    for (std::size_t i = 0; i < count; ++i) {
        std::string line;
        if (i == 0) {
            chain.append(line, R"("time":"2026-11-26T09:00:00.000Z","kind":"file","previous":")" +
                                   chain.last().hash + '"');
        } else {
            chain.append(line, body_of(i));
        }
        line.pop_back();
        lines.push_back(std::move(line));
    }
    return lines;
}

/// Writes the lines to a file of this name and verifies it.
Report verdict(const Lines& lines, const Anchors& anchors = {}, bool whole = true,
               const char* all_of = "") {
    const test::TempDir folder;
    const std::string name = (folder.path() / "audit.jsonl").string();
    std::ofstream out(name, std::ios::binary);
    for (std::size_t i = 0; i < lines.size(); ++i)
        out << lines[i] << (whole || i + 1 < lines.size() ? "\n" : "");
    out.close();
    return verify({name}, anchors, all_of);
}

std::string said(const Report& report) {
    if (!report.fault) return "right";
    return std::string(report.fault->kind) + ": " + report.fault->text;
}

TEST(AuditVerify, AChainIsRightFromItsFirstRecordToItsLast) {
    Chain chain;
    const Lines lines = chain_of(10, chain);
    const Report report = verdict(lines);
    EXPECT_EQ(said(report), "right");
    EXPECT_EQ(report.first, 1U);
    EXPECT_EQ(report.records, 10U);
    EXPECT_EQ(report.last, chain.last());
}

TEST(AuditVerify, TheHashIsThatOfAnyTool) {
    Chain chain;
    std::string line;
    chain.append(line, R"("kind":"start")");
    // printf '%064d{"n":1,"kind":"start"' 0 | sha256sum
    EXPECT_EQ(line, R"({"n":1,"kind":"start","hash":")"
                    R"(83483c049223c670f85929e4d7ad88069c1102a77b132983892491ca569d2de4"})"
                    "\n");
}

TEST(AuditVerify, AFileOfTheMiddleSaysWhatItFollows) {
    Chain chain;
    chain_of(5, chain);
    Lines lines = chain_of(5, chain);
    EXPECT_EQ(said(verdict(lines)), "right");
    lines.erase(lines.begin());
    EXPECT_EQ(said(verdict(lines)),
              "removed: the files begin with record 7, which does not begin a file: what stood "
              "before it was removed");
}

TEST(AuditVerify, NamesTheFirstLineThatDoesNotFollow) {
    Chain chain;
    const Lines lines = chain_of(10, chain);
    Lines changed = lines;
    changed[4].replace(changed[4].find("press"), 5, "mixer");
    EXPECT_EQ(said(verdict(changed)),
              "changed: record 5 was changed, or the hash of the one before");
    Lines ruined = lines;
    ruined[4].pop_back();
    EXPECT_EQ(said(verdict(ruined)),
              "changed: record 5 is no record any more, or a line was added before it");
    Lines less = lines;
    less.erase(less.begin() + 4, less.begin() + 6);
    EXPECT_EQ(said(verdict(less)),
              "removed: records 5 to 6 removed, or put elsewhere, before record 7");
    Lines more = lines;
    more.insert(more.begin() + 4, lines[3]);
    EXPECT_EQ(said(verdict(more)), "added: record 4 stands again behind record 4");
    Lines swapped = lines;
    std::swap(swapped[4], swapped[5]);
    EXPECT_EQ(said(verdict(swapped)),
              "removed: record 5 removed, or put elsewhere, before record 6");
}

TEST(AuditVerify, AChainMadeAnewIsFoundByTheAnchorsOfTheLog) {
    Chain chain;
    const Lines lines = chain_of(10, chain);
    Anchors anchors;
    collect_anchor("2026-11-26T09:00:00.123Z info audit anchor number=10 hash=" + chain.last().hash,
                   anchors);
    collect_anchor("2026-11-26T09:00:00.123Z info audit anchor number=x hash=12", anchors);
    ASSERT_EQ(anchors.chains[""].size(), 1U);
    EXPECT_EQ(verdict(lines, anchors).anchored, 1U);
    Chain forger(Position{8, std::string(parse_line(lines[7])->hash)});
    Lines forged(lines.begin(), lines.begin() + 8);
    for (const std::size_t i : {80U, 90U}) {
        std::string line;
        forger.append(line, body_of(i));
        line.pop_back();
        forged.push_back(line);
    }
    EXPECT_EQ(said(verdict(forged)), "right");
    EXPECT_EQ(said(verdict(forged, anchors)),
              "anchor: record 10 is another one than the log names: the chain was made anew, "
              "from there or from an earlier record on");
    forged.resize(8);
    EXPECT_EQ(said(verdict(forged, anchors)),
              "removed: records 9 to 10 removed at the end: the log names record 10");
}

const std::string kHash(32, 'a');

/// What one line of a log names.
Anchors named_by(const std::string& line) {
    Anchors anchors;
    collect_anchor(line, anchors);
    return anchors;
}

TEST(AuditVerify, AnchorsOfALogCountWhateverACollectorPutBeforeThem) {
    const std::string text = "info audit anchor number=12 hash=" + kHash + " chain=0c";
    const Lines said_as{
        text,
        "2026-11-26T09:00:00.123Z " + text,
        "<6>" + text,
        "Nov 26 09:00:00 host panelgate[7]: " + text + '\r',
        R"({"_PID":"7","MESSAGE":")" + text + R"(","PRIORITY":"6"})",
        R"({"time":"x","level":"info","event":"audit anchor","number":"12","hash":")" + kHash +
            R"(","chain":"0c"})"};
    for (const std::string& line : said_as)
        EXPECT_EQ(named_by(line).chains["0c"][12], kHash) << line;
}

TEST(AuditVerify, WhatAClientSendsIsNoAnchor) {
    const std::string anchor = "info audit anchor number=3 hash=" + kHash;
    const Lines sent{"info http request refused client=a path=\"/x/" + anchor + "\"",
                     "info x path=\"/x/\\\"MESSAGE\\\":\\\"" + anchor + "\"",
                     R"({"time":"x","event":"write refused","path":"\",\"event\":\"audit anchor\",)"
                     R"(\"number\":\"3\",\"hash\":\")" +
                         kHash + R"(\",\"x\":\""})",
                     R"({"time":"x","event":"x","path":")" + anchor + R"("})",
                     "info x why=x" + anchor,
                     "warn http refused why=\"error audit records lost count=7\""};
    for (const std::string& line : sent) {
        const Anchors anchors = named_by(line);
        EXPECT_TRUE(anchors.chains.empty()) << line;
        EXPECT_EQ(anchors.lost, 0U) << line;
    }
}

TEST(AuditVerify, OnlyAnchorsOfTheSameChainAreCompared) {
    Chain chain;
    Lines lines;
    for (const char* body : {R"("time":"T","kind":"file","previous":"0","chain":"0c","from":1)",
                             R"("kind":"start")"}) {
        std::string line;
        chain.append(line, body);
        line.pop_back();
        lines.push_back(line);
    }
    Anchors anchors = named_by("info audit anchor number=2 hash=" + kHash + " chain=0d");
    EXPECT_EQ(said(verdict(lines, anchors)), "right");
    anchors.is_read = true;
    EXPECT_EQ(said(verdict(lines, anchors)),
              "anchor: the log names no record of the chain '0c', so nothing was compared: it is "
              "another log, or the chain was made anew");
    collect_anchor("info audit anchor number=2 hash=" + chain.last().hash + " chain=0c", anchors);
    collect_anchor("error audit records lost count=7 file=/x", anchors);
    const Report report = verdict(lines, anchors);
    EXPECT_EQ(said(report), "right");
    EXPECT_EQ(report.remarks,
              (Lines{"the log says that 7 records could not be written when a run ended",
                     "the log names records of another chain '0d', up to record 2"}));
}

TEST(AuditVerify, AnotherChainThatWasWrittenToTheSameFileWasRemoved) {
    std::string line;
    Chain().append(line, R"("time":"T","kind":"file","previous":"0","chain":"0c","from":1)");
    line.pop_back();
    const std::string anchor = "info audit anchor number=2 hash=" + kHash + " chain=0d file=";
    for (const auto& [file, fault] :
         {std::pair{
              "/a.jsonl",
              "removed: the log names records of another chain '0d', up to record 2, which were "
              "written to this file and are not there"},
          std::pair{"/b.jsonl", "right"}})
        EXPECT_EQ(said(verdict({line}, named_by(anchor + file), true, "/a.jsonl")), fault);
}

TEST(AuditVerify, FilesThatTheChainSaysAreKeptMustBeThere) {
    Chain chain(Position{9, std::string(64, '0')});
    std::string line;
    chain.append(line, R"("time":"T","kind":"file","previous":")" + std::string(64, '0') +
                           R"(","chain":"0c","from":4,"gone":7)");
    line.pop_back();
    for (const bool all : {true, false}) {
        const Report report = verdict({line}, {}, true, all ? "audit.jsonl" : "");
        EXPECT_EQ(
            said(report),
            all ? "removed: records 4 to 9 removed: rotation has dropped only what stood before"
                : "removed: records 7 to 9 removed, moved away, or changed by others while the "
                  "gateway ran");
        ASSERT_EQ(report.remarks.size(), all ? 1U : 2U);
        EXPECT_EQ(report.remarks[0],
                  "record 10 (T): the file before was removed, moved away, or changed by others; "
                  "first record: 7");
    }
}

TEST(AuditVerify, AFileThatWentIsNotMissedWhereItIsRead) {
    Chain chain;
    Lines lines = chain_of(3, chain);
    std::string line;
    chain.append(line, R"("time":"T","kind":"file","previous":")" + chain.last().hash +
                           R"(","from":1,"gone":1)");
    line.pop_back();
    lines.push_back(line);
    EXPECT_EQ(said(verdict(lines)), "right");
}

TEST(AuditVerify, ATornEndIsNoWholeRecord) {
    Chain chain;
    Lines lines = chain_of(4, chain);
    lines.back().resize(20);
    EXPECT_EQ(said(verdict(lines, {}, false)),
              "torn: the last line is not whole: the gateway was killed while it was written, or "
              "the end was cut off");
}

TEST(AuditVerify, TellsWhatTheRecordsThemselvesSayIsMissing) {
    Chain chain;
    Lines lines = chain_of(1, chain);
    for (const char* body :
         {R"("time":"T1","kind":"start","unclean":true,"torn_bytes":12,"torn":"x","version":"1")",
          R"("time":"T2","kind":"lost","count":7)"}) {
        std::string line;
        chain.append(line, body);
        line.pop_back();
        lines.push_back(line);
    }
    const Report report = verdict(lines);
    EXPECT_EQ(said(report), "right");
    EXPECT_EQ(
        report.remarks,
        (Lines{"record 2 (T1): the run before did not end in order, its last second may be missing",
               "record 2 (T1): bytes of a torn line, which this record quotes: 12",
               "record 3 (T2): left out, because the disk took nothing: 7"}));
}

/// A random change of a chain: of a byte, or of the order, number or place of its lines.
Lines tampered(Lines lines, std::mt19937& random) {
    const auto any = [&](std::size_t below) {
        return std::uniform_int_distribution<std::size_t>(0, below - 1)(random);
    };
    const std::size_t i = any(lines.size());
    switch (any(6)) {
        case 0:
            lines[i][any(lines[i].size())] ^= static_cast<char>(1U << any(7));
            break;
        case 1:
            lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(i % (lines.size() - 1)));
            break;
        case 2:
            lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(any(lines.size())), lines[i]);
            break;
        case 3:
            std::swap(lines[i], lines[(i + 1 + any(lines.size() - 1)) % lines.size()]);
            break;
        case 4:
            lines[i].insert(any(lines[i].size()), 1, static_cast<char>('0' + any(10)));
            break;
        default:
            lines[i].erase(any(lines[i].size()), 1);
    }
    return lines;
}

TEST(AuditVerify, FindsEachOf1000RandomTamperings) {
    Chain chain;
    const Lines lines = chain_of(50, chain);
    std::mt19937 random(29);
    for (int round = 0; round < 1000; ++round) {
        const Lines others = tampered(lines, random);
        if (others == lines) continue;
        const Report report = verdict(others);
        ASSERT_TRUE(report.fault) << round;
        std::size_t same = 0;
        while (same < lines.size() && same < others.size() && lines[same] == others[same]) ++same;
        EXPECT_EQ(report.fault->line, same + 1) << round << ' ' << report.fault->text;
    }
}

TEST(AuditVerify, FilesAreReadInTheOrderOfTheirRecords) {
    const test::TempDir folder;
    Chain chain;
    std::vector<std::string> files;
    for (const char* name : {"c", "b", "a"}) {
        files.insert(files.begin(), (folder.path() / name).string());
        std::ofstream out(files.front());
        for (const std::string& line : chain_of(4, chain)) out << line << '\n';
    }
    EXPECT_EQ(said(verify(files)), "right");
    files.push_back((folder.path() / "none").string());
    EXPECT_EQ(verify(files).unread, files.back() + ": No such file or directory");
}

}  // namespace
}  // namespace panelgate::audit
