#include "panelgate/base/fault.hpp"

#include <gtest/gtest.h>

#include <set>
#include <stdexcept>

namespace panelgate::fault_test {
namespace {

TEST(Fault, HasAWordOfItsOwn) {
    std::set<std::string_view> words;
    for (const Fault fault : kAllFaults) words.insert(label(fault));
    EXPECT_EQ(words.size(), std::size(kAllFaults));
    EXPECT_EQ(label(Fault::line_down), "line_down");
}

TEST(Fault, UsesOnlyTheOutcomesOfTheMetric) {
    const std::set<std::string_view> outcomes = {"timeout", "damaged", "refused",   "busy",
                                                 "expired", "offline", "cancelled", "line_down"};
    std::set<std::string_view> used;
    for (const Fault fault : kAllFaults) used.insert(label(outcome_of(fault)));
    EXPECT_EQ(used, outcomes);
}

TEST(Fault, RefusedMeansNeverRouted) {
    EXPECT_EQ(outcome_of(Fault::denied), Outcome::refused);
    EXPECT_EQ(outcome_of(Fault::malformed), Outcome::refused);
    EXPECT_EQ(outcome_of(Fault::not_routed), Outcome::refused);
    EXPECT_EQ(outcome_of(Fault::line_lost), Outcome::line_down);
}

TEST(Fault, ThrowsWhenAValueIsAskedForThatIsNotThere) {
    const Result<int> result = Fault::timeout;
    EXPECT_THROW(static_cast<void>(result.value()), std::logic_error);
    EXPECT_EQ(result.error(), Fault::timeout);
}

}  // namespace
}  // namespace panelgate::fault_test
