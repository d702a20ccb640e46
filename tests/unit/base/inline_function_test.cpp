#include "panelgate/base/inline_function.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>

namespace panelgate::inline_function_test {
namespace {

using Ask = InlineFunction<int(int), 32>;

TEST(InlineFunction, CallsWhatItStores) {
    const int added = 5;
    const Ask ask = [&](int x) { return x + added; };
    EXPECT_TRUE(ask);
    EXPECT_EQ(ask(2), 7);
}

int twice(int x) { return 2 * x; }

TEST(InlineFunction, HoldsPlainFunctions) {
    const Ask ask = twice;
    EXPECT_EQ(ask(4), 8);
}

TEST(InlineFunction, IsEmptyAtFirstAndWhenItWasMovedFrom) {
    Ask empty;
    EXPECT_FALSE(empty);
    EXPECT_FALSE(Ask(nullptr));
    Ask full = [](int x) { return x; };
    const Ask taken = std::move(full);
    EXPECT_FALSE(full);  // NOLINT(bugprone-use-after-move): that is what is tested
    EXPECT_TRUE(taken);
    empty = taken;
    EXPECT_EQ(empty(3), 3);
    empty = nullptr;
    EXPECT_FALSE(empty);
}

TEST(InlineFunction, DestroysWhatItStoredOnce) {
    const auto held = std::make_shared<int>(1);
    {
        Ask ask = [held](int x) { return *held + x; };
        EXPECT_EQ(held.use_count(), 2);
        Ask moved = std::move(ask);
        EXPECT_EQ(held.use_count(), 2);
        const Ask copy = moved;
        EXPECT_EQ(held.use_count(), 3);
        EXPECT_EQ(copy(1) + moved(2), 5);
        moved = [](int) { return 0; };
        EXPECT_EQ(held.use_count(), 2);
    }
    EXPECT_EQ(held.use_count(), 1);
}

TEST(InlineFunction, ForwardsItsArgumentsAndMayChangeItsState) {
    int calls = 0;
    const InlineFunction<std::string(std::string), 16> shout = [&calls](std::string text) {
        ++calls;
        return std::move(text) + '!';
    };
    EXPECT_EQ(shout("a") + shout("b"), "a!b!");
    EXPECT_EQ(calls, 2);
    const InlineFunction<int(), 8> count = [n = 0]() mutable { return ++n; };
    count();
    EXPECT_EQ(count(), 2);
}

TEST(InlineFunction, RefersToItselfWhenItIsGivenToItself) {
    Ask ask = [](int x) { return 2 * x; };
    Ask& same = ask;
    ask = same;
    EXPECT_EQ(ask(4), 8);
}

}  // namespace
}  // namespace panelgate::inline_function_test
