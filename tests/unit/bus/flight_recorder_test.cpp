#include "panelgate/bus/flight_recorder.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace panelgate::bus {
namespace {

TraceDecision decision(std::string text) {
    return {.sequence = 99, .at = {}, .text = std::move(text)};
}

DecisionRecorder with(std::size_t limit, std::size_t entries) {
    DecisionRecorder recorder(limit);
    for (std::size_t i = 1; i <= entries; ++i) recorder.add(decision(std::to_string(i)));
    return recorder;
}

/// "3:3 4:4": sequence and text of each.
std::string told(const std::vector<TraceDecision>& entries) {
    std::string text;
    for (const TraceDecision& entry : entries)
        text += (text.empty() ? "" : " ") + std::to_string(entry.sequence) + ':' + entry.text;
    return text;
}

TEST(Recorder, NumbersFromOneWhateverTheEntrySays) {
    EXPECT_EQ(told(with(8, 3).last(8)), "1:1 2:2 3:3");
}

TEST(Recorder, GivesTheLastOnesTheOldestFirst) {
    const DecisionRecorder recorder = with(8, 5);
    EXPECT_EQ(told(recorder.last(2)), "4:4 5:5");
    EXPECT_EQ(told(recorder.last(0)), "");
    EXPECT_EQ(told(recorder.last(5)), "1:1 2:2 3:3 4:4 5:5");
    EXPECT_EQ(told(with(8, 0).last(3)), "");
}

TEST(Recorder, ForgetsTheOldestWhenItIsFullAndCountsOn) {
    EXPECT_EQ(told(with(3, 3).last(8)), "1:1 2:2 3:3");
    EXPECT_EQ(told(with(3, 4).last(8)), "2:2 3:3 4:4");
    EXPECT_EQ(told(with(3, 300).last(8)), "298:298 299:299 300:300");
}

TEST(Recorder, WhatWasGivenDoesNotChangeWithIt) {
    DecisionRecorder recorder = with(2, 2);
    const std::vector<TraceDecision> before = recorder.last(2);
    recorder.add(decision("3"));
    EXPECT_EQ(told(before), "1:1 2:2");
    EXPECT_EQ(told(recorder.last(2)), "2:2 3:3");
}

TEST(Recorder, OneThatKeepsNothingStaysEmpty) { EXPECT_EQ(told(with(0, 5).last(8)), ""); }

}  // namespace
}  // namespace panelgate::bus
