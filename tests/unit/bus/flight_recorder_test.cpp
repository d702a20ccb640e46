#include "panelgate/bus/trace.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "support/hex.hpp"

namespace panelgate::bus::flight_recorder_test {
namespace {

TraceDecision decision(std::uint64_t sequence) {
    TraceDecision made;
    made.sequence = sequence;
    made.text = std::to_string(sequence);
    return made;
}

using DecisionRecorder = Recorder<TraceDecision>;

DecisionRecorder with(std::size_t limit, std::size_t entries) {
    DecisionRecorder recorder(limit);
    for (std::size_t i = 1; i <= entries; ++i) recorder.add(decision(i));
    return recorder;
}

/// "3:3 4:4": sequence and text of each.
std::string summary_of(const std::vector<TraceDecision>& entries) {
    std::string text;
    for (const TraceDecision& entry : entries)
        text += (text.empty() ? "" : " ") + std::to_string(entry.sequence) + ':' + entry.text;
    return text;
}

TEST(Recorder, GivesTheLastOnesTheOldestFirst) {
    const DecisionRecorder recorder = with(8, 5);
    EXPECT_EQ(summary_of(recorder.last(2)), "4:4 5:5");
    EXPECT_EQ(summary_of(recorder.last(0)), "");
    EXPECT_EQ(summary_of(recorder.last(5)), "1:1 2:2 3:3 4:4 5:5");
    EXPECT_EQ(summary_of(with(8, 0).last(3)), "");
}

TEST(Recorder, ForgetsTheOldestWhenItIsFullAndCountsOn) {
    EXPECT_EQ(summary_of(with(3, 3).last(8)), "1:1 2:2 3:3");
    EXPECT_EQ(summary_of(with(3, 4).last(8)), "2:2 3:3 4:4");
    EXPECT_EQ(summary_of(with(3, 300).last(8)), "298:298 299:299 300:300");
}

TEST(Recorder, WhatWasGivenDoesNotChangeWithIt) {
    DecisionRecorder recorder = with(2, 2);
    const std::vector<TraceDecision> before = recorder.last(2);
    recorder.add(decision(3));
    EXPECT_EQ(summary_of(before), "1:1 2:2");
    EXPECT_EQ(summary_of(recorder.last(2)), "2:2 3:3");
}

TEST(Recorder, GivesTheFirstOnesBehindANumber) {
    const DecisionRecorder recorder = with(3, 6);
    EXPECT_EQ(summary_of(recorder.since(4, 8)), "5:5 6:6");
    EXPECT_EQ(summary_of(recorder.since(0, 2)), "4:4 5:5") << "what it has forgotten is not there";
    EXPECT_EQ(summary_of(recorder.since(6, 8)), "");
    EXPECT_EQ(summary_of(recorder.since(99, 8)), "");
    EXPECT_EQ(summary_of(recorder.since(4, 0)), "");
    DecisionRecorder gaps(8);
    for (const std::uint64_t sequence : {2u, 5u, 9u}) gaps.add(decision(sequence));
    EXPECT_EQ(summary_of(gaps.since(3, 8)), "5:5 9:9") << "others have numbers, too";
}

TEST(Recorder, TheOldestMayBeForgottenBeforeItIsFull) {
    DecisionRecorder recorder = with(3, 4);
    recorder.drop_oldest();
    EXPECT_EQ(summary_of(recorder.last(8)), "3:3 4:4");
    recorder.add(decision(5));
    recorder.add(decision(6));
    EXPECT_EQ(summary_of(recorder.last(8)), "4:4 5:5 6:6");
    for (int i = 0; i < 5; ++i) recorder.drop_oldest();
    EXPECT_TRUE(recorder.empty());
    recorder.add(decision(7));
    EXPECT_EQ(summary_of(recorder.since(0, 8)), "7:7");
    recorder.clear();
    EXPECT_EQ(summary_of(recorder.last(8)), "");
    recorder.add(decision(8));
    EXPECT_EQ(summary_of(recorder.last(8)), "8:8");
}

TEST(ByteRing, GivesBackWhatWasNotOverwrittenAlsoAcrossItsEnd) {
    ByteRing ring(8);
    const auto first = ring.add("01 02 03 04 05"_hex);
    const auto second = ring.add("0A 0B 0C 0D"_hex);
    EXPECT_FALSE(ring.has(first)) << "its first byte is gone";
    ASSERT_TRUE(ring.has(second));
    EXPECT_EQ(ring.at(second, 4), "0A 0B 0C 0D"_hex);
    EXPECT_EQ(ring.used_since(second), 4u);
    const auto third = ring.add("21 22 23 24"_hex);
    EXPECT_TRUE(ring.has(second)) << "both fit exactly";
    EXPECT_EQ(ring.at(third, 4), "21 22 23 24"_hex);
}

TEST(ByteRing, KeepsTheBeginningOfWhatIsLongerThanIt) {
    ByteRing ring(4);
    const auto place = ring.add("01 02 03 04 05 06"_hex);
    EXPECT_TRUE(ring.has(place));
    EXPECT_EQ(ring.at(place, 4), "01 02 03 04"_hex);
}

TEST(Recorder, OneThatKeepsNothingStaysEmpty) { EXPECT_EQ(summary_of(with(0, 5).last(8)), ""); }

}  // namespace
}  // namespace panelgate::bus::flight_recorder_test
