#include <gtest/gtest.h>

#include <string>

#include "panelgate/base/words.hpp"

namespace panelgate::words_test {
namespace {

/// Labels of the first `count` enumerators, in order, separated by commas.
template <class Enum>
std::string words(std::size_t count) {
    std::string text;
    for (std::size_t i = 0; i < count; ++i)
        text.append(i == 0 ? "" : ",").append(label(static_cast<Enum>(i)));
    return text;
}

TEST(Words, OfOutcomesAreThoseOfTheMetric) {
    EXPECT_EQ(words<Outcome>(kAllOutcomes.size()),
              "ok,exception,timeout,damaged,refused,busy,expired,cancelled,offline,line_down,"
              "cached,shared");
    for (std::size_t i = 0; i < kAllOutcomes.size(); ++i)
        EXPECT_EQ(static_cast<std::size_t>(kAllOutcomes[i]), i) << "counted by its place";
}

TEST(Words, OfPriorityClassesAreThoseOfTheMetric) {
    EXPECT_EQ(words<PriorityClass>(kPriorityClasses), "write,read,poll,probe");
}

TEST(Words, OfStationsAndEchoesAreThoseOfRest) {
    EXPECT_EQ(words<Health>(5), "unknown,online,suspect,heard,offline");
    EXPECT_EQ(words<EchoState>(4), "unknown,absent,present,unclear");
}

TEST(Words, OfFramesAreThoseOfTheTrace) {
    EXPECT_EQ(words<FrameKind>(13),
              "request,retry,probe,learn echo,broadcast,reply,heard request,damaged,echo,"
              "foreign request,late,copy,foreign");
    EXPECT_EQ(words<FrameDirection>(3), "sent,received,discarded");
}

TEST(Words, AFrameIsSentReceivedOrDiscardedByWhatItIs) {
    EXPECT_EQ(direction_of(FrameKind::probe), FrameDirection::sent);
    EXPECT_EQ(direction_of(FrameKind::reply), FrameDirection::received);
    EXPECT_EQ(direction_of(FrameKind::late), FrameDirection::discarded);
}

TEST(OutcomeCounts, CountEachOutcomeByItself) {
    OutcomeCounts counts;
    ++counts[Outcome::shared];
    ++counts[Outcome::shared];
    EXPECT_EQ(counts[Outcome::shared], 2u);
    EXPECT_EQ(counts[Outcome::ok], 0u);
}

}  // namespace
}  // namespace panelgate::words_test
