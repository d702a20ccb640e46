#include "panelgate/arbiter/read_cache.hpp"

#include <gtest/gtest.h>

#include <cstdint>

#include "support/hex.hpp"
#include "support/read_span.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::read_cache_test {
namespace {

const Bytes kRead = "03 00 6B 00 03"_hex;
const Bytes kReply = "03 06 02 2B 00 00 00 64"_hex;
const Bytes kWrite = "06 00 6B 00 01"_hex;
constexpr TimePoint kStart{1h};

TEST(ReadCache, AnswersWhatItHoldsWhileItIsYoungEnough) {
    ReadCache cache;
    const TimePoint start{1h};
    cache.store(*test::read_span(17, kRead), kReply, start);
    const auto part = *test::read_span(17, "03 00 6C 00 01"_hex);
    const auto hit = cache.find(part, start + 1s, 1s);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->pdu, "03 02 00 00"_hex);
    EXPECT_EQ(hit->age, Duration(1s));
    EXPECT_FALSE(cache.find(part, start + 1001ms, 1s));
    EXPECT_FALSE(cache.find(*test::read_span(18, kRead), start, 1s));
    EXPECT_FALSE(cache.find(*test::read_span(17, "04 00 6B 00 03"_hex), start, 1s));
    EXPECT_FALSE(cache.find(*test::read_span(17, "03 00 6B 00 04"_hex), start, 1s));
}

TEST(ReadCache, P6AWriteForgetsWhatItMayChange) {
    struct Case {
        std::uint8_t station;
        Bytes request;
        bool kept;
    };
    for (const Case& c :
         {Case{17, "06 00 6B 00 01"_hex, false}, Case{17, "06 00 6E 00 01"_hex, true},
          Case{17, "10 00 69 00 02 04 00 00 00 00"_hex, true},
          Case{17, "10 00 69 00 03 06 00 00 00 00 00 00"_hex, false},
          Case{17, "17 00 00 00 01 00 6D 00 01 02 00 00"_hex, false},
          Case{18, "06 00 6B 00 01"_hex, true}, Case{0, "06 00 6B 00 01"_hex, false},
          Case{17, "05 04 00 FF 00"_hex, false}, Case{17, "41 01"_hex, false}}) {
        ReadCache cache;
        cache.store(*test::read_span(17, kRead), kReply, TimePoint{});
        cache.on_write(TimePoint{1h}, c.station, test::request_of(c.request));
        EXPECT_EQ(cache.size(), c.kept ? 1u : 0u) << to_hex(c.request);
    }
}

TEST(ReadCache, IsBounded) {
    ReadCache cache;
    for (unsigned i = 0; i < 3 * ReadCache::kEntries; ++i) {
        const Bytes read = Writer().u8(3).u16(10 * i).u16(1).take();
        cache.store(*test::read_span(17, read), "03 02 00 00"_hex, TimePoint{});
    }
    EXPECT_EQ(cache.size(), ReadCache::kEntries);
}

TEST(ReadCache, TheYoungestValueAnswers) {
    ReadCache cache;
    const Bytes newer = "03 06 00 01 00 02 00 03"_hex;
    cache.store(*test::read_span(17, kRead), kReply, kStart);
    cache.store(*test::read_span(17, kRead), newer, kStart + 1s);
    EXPECT_EQ(cache.size(), 1u) << "the older one is of no use any more";
    const auto hit = cache.find(*test::read_span(17, kRead), kStart + 3s, 1min);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->pdu, newer);
    EXPECT_EQ(hit->age, Duration(2s));
    cache.store(*test::read_span(17, "03 00 6C 00 01"_hex), "03 02 00 09"_hex, kStart + 2s);
    EXPECT_EQ(cache.find(*test::read_span(17, "03 00 6C 00 01"_hex), kStart + 3s, 1min)->pdu,
              "03 02 00 09"_hex);
    EXPECT_EQ(cache.find(*test::read_span(17, kRead), kStart + 3s, 1min)->pdu, newer)
        << "the wider one is kept for the rest";
}

TEST(ReadCache, P6WhatWasReadBeforeAWriteIsNotKeptWhenItComesBehindIt) {
    for (const std::uint8_t written : Bytes{17, 0}) {
        ReadCache cache;
        cache.on_write(kStart, written, test::request_of(kWrite));
        cache.store(*test::read_span(17, kRead), kReply, kStart);
        EXPECT_EQ(cache.size(), 0u) << "nobody knows which came first";
        cache.store(*test::read_span(17, kRead), kReply, kStart + 1ms);
        EXPECT_EQ(cache.size(), 1u);
    }
    ReadCache cache;
    cache.on_write(kStart, 18, test::request_of(kWrite));
    cache.store(*test::read_span(17, kRead), kReply, kStart);
    EXPECT_EQ(cache.size(), 1u) << "another station was written to";
}

TEST(ReadCache, BitsOfAWiderReadAreCutOut) {
    ReadCache cache;
    cache.store(*test::read_span(17, "01 00 13 00 13"_hex), "01 03 CD 6B 05"_hex, kStart);
    const auto hit = cache.find(*test::read_span(17, "01 00 15 00 03"_hex), kStart, 1s);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->pdu, "01 01 03"_hex) << "CD is 1100 1101: items 13h to 1Ah from the right";
}

}  // namespace
}  // namespace panelgate::arbiter::read_cache_test
