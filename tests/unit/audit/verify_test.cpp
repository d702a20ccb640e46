#include "panelgate/audit/verify.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

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
                                   std::string(text_of(chain.last().hash)) + '"');
        } else {
            chain.append(line, body_of(i));
        }
        line.pop_back();
        lines.push_back(std::move(line));
    }
    return lines;
}

Report verify(const Lines& lines, const Anchors& anchors = {}, bool whole = true) {
    Verifier verifier(anchors);
    verifier.begin_file("audit.jsonl");
    for (std::size_t i = 0; i < lines.size(); ++i) {
        if (!verifier.take(lines[i], whole || i + 1 < lines.size())) break;
    }
    return verifier.finish();
}

std::string said(const Report& report) {
    if (!report.fault) return "right";
    return std::string(label(report.fault->kind)) + ' ' + std::to_string(report.fault->number) +
           ": " + report.fault->text;
}

TEST(AuditVerify, AChainIsRightFromItsFirstRecordToItsLast) {
    Chain chain;
    const Lines lines = chain_of(10, chain);
    const Report report = verify(lines);
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
    EXPECT_EQ(said(verify(lines)), "right");
    lines.erase(lines.begin());
    EXPECT_EQ(said(verify(lines)),
              "removed 7: the files begin with record 7, which does not begin a file: what stood "
              "before it was removed");
}

TEST(AuditVerify, NamesTheFirstRecordThatWasChanged) {
    Chain chain;
    const Lines lines = chain_of(10, chain);
    Lines changed = lines;
    changed[4].replace(changed[4].find("press"), 5, "mixer");
    EXPECT_EQ(said(verify(changed)),
              "changed 5: record 5 was changed (or record 4 together with its hash)");
    Lines ruined = lines;
    ruined[4].pop_back();
    EXPECT_EQ(said(verify(ruined)), "changed 5: record 5 is no record any more");
    Lines last = lines;
    last[9].replace(last[9].find("press"), 5, "mixer");
    EXPECT_EQ(said(verify(last)), "changed 10: record 10 was changed");
}

TEST(AuditVerify, NamesWhatWasRemovedAddedOrPutElsewhere) {
    Chain chain;
    const Lines lines = chain_of(10, chain);
    Lines less = lines;
    less.erase(less.begin() + 4, less.begin() + 6);
    EXPECT_EQ(said(verify(less)), "removed 5: records 5 to 6 removed before record 7");
    Lines more = lines;
    more.insert(more.begin() + 4, lines[3]);
    EXPECT_EQ(said(verify(more)), "added 4: record 4 stands again behind record 4");
    Lines false_one = lines;
    Chain other(Position{4, no_hash()});
    std::string line;
    other.append(line, body_of(77));
    line.pop_back();
    false_one.insert(false_one.begin() + 4, line);
    EXPECT_EQ(said(verify(false_one)), "added 5: a line was added before record 5");
    Lines comment = lines;
    comment.insert(comment.begin() + 4, "# nothing to see");
    EXPECT_EQ(said(verify(comment)), "added 5: a line was added before record 5");
    Lines copied = lines;
    copied.insert(copied.begin() + 4, lines[8]);
    EXPECT_EQ(said(verify(copied)), "added 9: a copy of record 9 was added before record 5");
    Lines swapped = lines;
    std::swap(swapped[4], swapped[5]);
    EXPECT_EQ(said(verify(swapped)), "reordered 6: record 6 stands where record 5 belongs");
    Lines later = lines;
    later.insert(later.begin() + 9, lines[4]);
    later.erase(later.begin() + 4);
    EXPECT_EQ(said(verify(later)), "reordered 5: record 6 stands where record 5 belongs");
}

TEST(AuditVerify, AChainMadeAnewIsFoundByTheAnchorsOfTheLog) {
    Chain chain;
    const Lines lines = chain_of(10, chain);
    Anchors anchors;
    collect_anchor("2026-11-26T09:00:00.123Z info audit anchor number=10 hash=" +
                       std::string(text_of(chain.last().hash)),
                   anchors);
    collect_anchor("2026-11-26T09:00:00.123Z info audit anchor number=x hash=12", anchors);
    ASSERT_EQ(anchors.chains[""].size(), 1U);
    EXPECT_EQ(verify(lines, anchors).anchored, 1U);
    Chain forger(Position{8, parse_line(lines[7])->hash});
    Lines forged(lines.begin(), lines.begin() + 8);
    for (const std::size_t i : {80U, 90U}) {
        std::string line;
        forger.append(line, body_of(i));
        line.pop_back();
        forged.push_back(line);
    }
    EXPECT_EQ(said(verify(forged)), "right");
    EXPECT_EQ(said(verify(forged, anchors)),
              "anchor 10: record 10 is another one than the log names: the chain was made anew, "
              "from there or from an earlier record on");
    forged.resize(8);
    EXPECT_EQ(said(verify(forged, anchors)),
              "removed 9: the log names record 10, but the files end with record 8: records 9 to "
              "10 removed at the end");
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
    EXPECT_EQ(said(verify(lines, anchors)), "right");
    anchors.is_read = true;
    EXPECT_EQ(said(verify(lines, anchors)),
              "anchor 2: the log names no record of the chain 0c in these files, so nothing was "
              "compared: it is another log, or the chain was made anew");
    collect_anchor(
        "info audit anchor number=2 hash=" + std::string(text_of(chain.last().hash)) + " chain=0c",
        anchors);
    collect_anchor("error audit records lost count=7 file=/x", anchors);
    const Report report = verify(lines, anchors);
    EXPECT_EQ(said(report), "right");
    EXPECT_EQ(report.remarks,
              (Lines{"the log says that 7 records could not be written when a run ended",
                     "the log names records of another chain too, 0d, up to record 2: of another "
                     "audit, or of one that was removed"}));
}

TEST(AuditVerify, AnotherChainThatWasWrittenToTheSameFileWasRemoved) {
    std::string line;
    Chain().append(line, R"("time":"T","kind":"file","previous":"0","chain":"0c","from":1)");
    line.pop_back();
    const std::string anchor = "info audit anchor number=2 hash=" + kHash + " chain=0d file=";
    for (const auto& [file, fault] :
         {std::pair{"/a.jsonl",
                    "removed 2: the log names records of another chain too, 0d, up to record 2, "
                    "which were written to this file and are not there"},
          std::pair{"/b.jsonl", "right"}}) {
        Verifier verifier(named_by(anchor + file), "/a.jsonl");
        verifier.begin_file("/a.jsonl");
        verifier.take(line, true);
        EXPECT_EQ(said(verifier.finish()), fault);
    }
}

TEST(AuditVerify, FilesThatTheChainSaysAreKeptMustBeThere) {
    Chain chain(Position{9, no_hash()});
    std::string line;
    chain.append(line, R"("time":"T","kind":"file","previous":")" +
                           std::string(text_of(no_hash())) + R"(","chain":"0c","from":4,"gone":7)");
    line.pop_back();
    for (const bool all : {true, false}) {
        Verifier verifier({}, all ? "audit.jsonl" : "");
        verifier.begin_file("audit.jsonl");
        verifier.take(line, true);
        const Report report = verifier.finish();
        EXPECT_EQ(said(report), all ? "removed 4: records 4 to 9 removed: the files begin with "
                                      "record 10, and rotation has dropped only what stood before "
                                      "record 4"
                                    : "right");
        ASSERT_EQ(report.remarks.size(), all ? 1U : 2U);
        EXPECT_EQ(report.remarks[0],
                  "record 10 (T): the file before was removed, or changed by others, while it was "
                  "written, with the "
                  "records from 7 on");
    }
}

TEST(AuditVerify, ATornEndIsNoWholeRecord) {
    Chain chain;
    Lines lines = chain_of(4, chain);
    lines.back().resize(20);
    EXPECT_EQ(said(verify(lines, {}, false)),
              "torn 4: the last line is not whole: the gateway was killed while it was written, or "
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
    const Report report = verify(lines);
    EXPECT_EQ(said(report), "right");
    EXPECT_EQ(report.remarks,
              (Lines{"record 2 (T1): the run before did not end in order; what it did in its last "
                     "second, or since its log says `audit fails`, may be missing",
                     "record 2 (T1): a torn line of 12 bytes was found and taken over into this "
                     "record",
                     "record 3 (T2): 7 records were left out, the disk took nothing"}));
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

TEST(AuditVerify, FindsEachOf2000RandomTamperings) {
    Chain chain;
    const Lines lines = chain_of(50, chain);
    std::mt19937 random(29);
    for (int round = 0; round < 2000; ++round) {
        const Lines others = tampered(lines, random);
        if (others == lines) continue;
        const Report report = verify(others);
        ASSERT_TRUE(report.fault) << round;
        std::size_t same = 0;
        while (same < lines.size() && same < others.size() && lines[same] == others[same]) ++same;
        EXPECT_EQ(report.fault->line, same + 1) << round << ' ' << report.fault->text;
    }
}

TEST(AuditVerify, FilesAreReadInTheOrderOfTheirRecords) {
    const auto head = [](const std::string& file) {
        const std::string number = file.substr(1);
        return R"({"n":)" + number + R"(,"kind":"file","hash":")" + std::string(64, '0') + "\"}";
    };
    EXPECT_EQ(in_order({"a30", "b4", "c100"}, head), (Lines{"b4", "a30", "c100"}));
}

}  // namespace
}  // namespace panelgate::audit
