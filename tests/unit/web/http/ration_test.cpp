#include "admission.hpp"

#include <gtest/gtest.h>

namespace panelgate::web::ration_test {
namespace {

constexpr TimePoint kStart{1h};

RateLimitSettings settings() {
    RateLimitSettings made;
    made.request = 1ms;
    made.bytes_per_second = 1000 * 1000;
    made.burst = 100ms;
    made.longest_wait = 2s;
    return made;
}

/// Returns how many requests of this size are answered in ten seconds if the client never pauses.
int answered(RateLimiter& rate_limit, const std::string& address, std::size_t bytes) {
    int count = 0;
    for (TimePoint now = kStart; now < kStart + 10s; ++count)
        now += rate_limit.take(now, address, bytes);
    return count;
}

TEST(RateLimiter, AnAddressHasItsRateAndABurst) {
    RateLimiter rate_limit(settings());
    EXPECT_NEAR(answered(rate_limit, "a", 0), 10'000 + 100, 2);
    EXPECT_NEAR(answered(rate_limit, "b", 9'000), 1'000 + 10, 2) << "and is alone with its share";
}

TEST(RateLimiter, ARareClientNeverWaits) {
    RateLimiter rate_limit(settings());
    for (TimePoint now = kStart; now < kStart + 10s; now += 50ms)
        ASSERT_EQ(rate_limit.take(now, "a", 40'000), Duration::zero());
}

TEST(RateLimiter, NoClientOfABusyAddressWaitsForever) {
    RateLimiter rate_limit(settings());
    Duration longest{};
    for (int i = 0; i < 100; ++i)
        longest = std::max(longest, rate_limit.take(kStart, "a", 1'000'000));
    EXPECT_EQ(longest, Duration(2s));
}

}  // namespace
}  // namespace panelgate::web::ration_test
