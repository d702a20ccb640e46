#include "admission.hpp"

#include <gtest/gtest.h>

namespace panelgate::web {
namespace {

constexpr TimePoint kStart{1h};

RationSettings settings() {
    RationSettings made;
    made.request = 1ms;
    made.bytes_a_second = 1000 * 1000;
    made.burst = 100ms;
    made.longest_wait = 2s;
    return made;
}

/// How many requests of so many bytes are answered in ten seconds to who asks again at once.
int answered(Ration& ration, const std::string& address, std::size_t bytes) {
    int count = 0;
    for (TimePoint now = kStart; now < kStart + 10s; ++count)
        now += ration.take(now, address, bytes);
    return count;
}

TEST(Ration, AnAddressHasItsRateAndABurst) {
    Ration ration(settings());
    EXPECT_NEAR(answered(ration, "a", 0), 10'000 + 100, 2);
    EXPECT_NEAR(answered(ration, "b", 9'000), 1'000 + 10, 2) << "and is alone with its share";
}

TEST(Ration, WhoAsksSeldomNeverWaits) {
    Ration ration(settings());
    for (TimePoint now = kStart; now < kStart + 10s; now += 50ms)
        ASSERT_EQ(ration.take(now, "a", 40'000), Duration::zero());
}

TEST(Ration, NobodyWaitsForeverForWhatManyHaveUsedUp) {
    Ration ration(settings());
    Duration longest{};
    for (int i = 0; i < 100; ++i) longest = std::max(longest, ration.take(kStart, "a", 1'000'000));
    EXPECT_EQ(longest, Duration(2s));
}

}  // namespace
}  // namespace panelgate::web
