#include "panelgate/base/words.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <iterator>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>

#include "panelgate/base/fault.hpp"

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

TEST(Words, AreThoseOfMetricsRestAndTheTrace) {
    EXPECT_EQ(words<Outcome>(kAllOutcomes.size()),
              "ok,exception,timeout,damaged,refused,busy,expired,cancelled,offline,line_down,"
              "cached,shared");
    for (std::size_t i = 0; i < kAllOutcomes.size(); ++i)
        EXPECT_EQ(static_cast<std::size_t>(kAllOutcomes[i]), i) << "counted by its place";
    EXPECT_EQ(words<PriorityClass>(kPriorityClasses), "write,read,poll,probe");
    EXPECT_EQ(words<Health>(5), "unknown,online,suspect,heard,offline");
    EXPECT_EQ(words<EchoState>(4), "unknown,absent,present,unclear");
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

TEST(Fault, HasAWordOfItsOwnAndAnOutcomeOfTheMetric) {
    const std::set<std::string_view> outcomes = {"timeout", "damaged", "refused",   "busy",
                                                 "expired", "offline", "cancelled", "line_down"};
    std::set<std::string_view> labels;
    std::set<std::string_view> used;
    for (const Fault fault : kAllFaults) {
        labels.insert(label(fault));
        used.insert(label(outcome_of(fault)));
    }
    EXPECT_EQ(labels.size(), std::size(kAllFaults));
    EXPECT_EQ(used, outcomes);
    EXPECT_EQ(label(Fault::line_down), "line_down");
    for (const Fault fault : {Fault::denied, Fault::malformed, Fault::not_routed})
        EXPECT_EQ(outcome_of(fault), Outcome::refused) << "never routed";
    EXPECT_EQ(outcome_of(Fault::line_lost), Outcome::line_down);
}

TEST(Fault, ThrowsWhenAValueIsAskedForThatIsNotThere) {
    const Result<int> result = Fault::timeout;
    EXPECT_THROW(static_cast<void>(result.value()), std::logic_error);
    EXPECT_EQ(result.error(), Fault::timeout);
}

}  // namespace
}  // namespace panelgate::words_test
