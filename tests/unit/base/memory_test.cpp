// Bytes and what holds them: the pool, and callables stored in place.
#include "panelgate/base/bytes.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "panelgate/base/inline_function.hpp"
#include "panelgate/base/pool.hpp"
#include "support/hex.hpp"

namespace panelgate::memory_test {
namespace {

TEST(Reader, ReadsBigEndian) {
    const Bytes bytes = "01 02 03 04 05"_hex;
    Reader in(bytes);
    EXPECT_EQ(in.u8(), 0x01);
    EXPECT_EQ(in.u16(), 0x0203);
    EXPECT_EQ(in.left(), 2u);
    EXPECT_TRUE(in.ok());
    EXPECT_FALSE(in.finished());
    const ByteView rest = in.take(2);
    EXPECT_EQ(Bytes(rest.begin(), rest.end()), "04 05"_hex);
    EXPECT_TRUE(in.finished());
}

TEST(Reader, StaysFailedOnceItReadPastTheEnd) {
    const Bytes bytes = "01"_hex;
    Reader in(bytes);
    EXPECT_EQ(in.u16(), 0);
    EXPECT_FALSE(in.ok());
    EXPECT_EQ(in.u8(), 0) << "although a byte is left";
    EXPECT_TRUE(in.take(1).empty());
    EXPECT_FALSE(in.finished());
    Reader nothing({});
    EXPECT_TRUE(nothing.take(0).empty());
    EXPECT_TRUE(nothing.finished());
    EXPECT_EQ(nothing.u8(), 0);
    EXPECT_FALSE(nothing.finished());
}

TEST(Writer, WritesBigEndianAndCutsToSize) {
    Writer out;
    out.u8(0x101).u16(0x10203).raw("04 05"_hex);
    EXPECT_EQ(out.take(), "01 02 03 04 05"_hex);
}

TEST(Hex, IsLowerCaseWithTheSeparatorAndReadInPairs) {
    const Bytes bytes = {0x1F, 0x03, 0xAB};
    EXPECT_EQ(to_hex(bytes), "1f 03 ab");
    EXPECT_EQ(to_hex(bytes, ""), "1f03ab");
    EXPECT_EQ(to_hex({}), "");
    EXPECT_EQ(from_hex("1f 03 AB"), bytes);
    EXPECT_EQ(from_hex(" 1F03  aB "), bytes);
    EXPECT_EQ(from_hex(""), Bytes());
    for (const char* text : {"1", "1f 0", "1 f", "1f,03", "0x1f", "1g", "g1", "1f\n03"})
        EXPECT_FALSE(from_hex(text)) << text;
    Bytes all;
    for (int i = 0; i < 256; ++i) all.push_back(static_cast<std::uint8_t>(i));
    EXPECT_EQ(from_hex(to_hex(all)), all);
    EXPECT_EQ(from_hex(to_hex(all, "")), all);
}

TEST(Bytes, AreAppendedUpToALimit) {
    Bytes bytes{1, 2};
    const Bytes more{3, 4, 5};
    append_up_to(4, bytes, more);
    EXPECT_EQ(bytes, (Bytes{1, 2, 3, 4}));
    append_up_to(4, bytes, more);
    append_up_to(3, bytes, more);  // beyond it already
    EXPECT_EQ(bytes, (Bytes{1, 2, 3, 4}));
    append_up_to(9, bytes, more);
    EXPECT_EQ(bytes, (Bytes{1, 2, 3, 4, 3, 4, 5}));
}

TEST(Pool, GivesABlockThatCameBackToTheNextOfItsSize) {
    if (!pool::keeps_blocks()) GTEST_SKIP() << "AddressSanitizer watches each block";
    void* const first = pool::take(40);
    pool::give_back(first, 40);
    void* const other = pool::take(100);
    void* const again = pool::take(33);  // rounded up alike
    EXPECT_NE(other, first);
    EXPECT_EQ(again, first);
    pool::give_back(other, 100);
    pool::give_back(again, 33);
}

TEST(Pool, BlocksAreApartAlignedAndAsLargeAsAsked) {
    std::vector<std::pair<std::byte*, std::size_t>> blocks;
    for (std::size_t size = 1; size <= pool::kLargest + 20; size += 1 + size / 40) {
        auto* const block = static_cast<std::byte*>(pool::take(size));
        EXPECT_EQ(reinterpret_cast<std::uintptr_t>(block) % alignof(std::max_align_t), 0u);
        std::memset(block, static_cast<int>(size & 0xFF), size);
        blocks.emplace_back(block, size);
    }
    for (const auto& [block, size] : blocks) {
        EXPECT_EQ(block[0], static_cast<std::byte>(size & 0xFF));
        EXPECT_EQ(block[size - 1], static_cast<std::byte>(size & 0xFF));
    }
    for (const auto& [block, size] : blocks) pool::give_back(block, size);
}

TEST(Pool, ABlockMayComeBackInAnotherThread) {
    PoolVector<int> numbers(100, 7);
    std::thread([moved = std::move(numbers)]() mutable {
        moved.resize(10);
        const PoolVector<int> gone = std::move(moved);
        EXPECT_EQ(gone[9], 7);
    }).join();
    EXPECT_TRUE(PoolVector<int>(3).capacity() >= 3);
}

TEST(Pool, GivesNoBlockTwiceBeyondWhatItKeeps) {
    std::vector<void*> blocks;
    for (std::size_t taken = 0; taken < 4 * pool::kKept; taken += 512)
        blocks.push_back(pool::take(512));
    for (void* block : blocks) pool::give_back(block, 512);
    std::set<void*> again;
    for (std::size_t i = 0; i < blocks.size(); ++i) again.insert(pool::take(512));
    EXPECT_EQ(again.size(), blocks.size());
    for (void* block : again) pool::give_back(block, 512);
}

using Ask = InlineFunction<int(int), 32>;

int twice(int x) { return 2 * x; }

TEST(InlineFunction, CallsWhatItStores) {
    const int added = 5;
    EXPECT_EQ(Ask([&](int x) { return x + added; })(2), 7);
    EXPECT_EQ(Ask(twice)(4), 8) << "a plain function";
    int calls = 0;
    const InlineFunction<std::string(std::string), 16> shout = [&calls](std::string text) {
        ++calls;
        return std::move(text) + '!';
    };
    EXPECT_EQ(shout("a") + shout("b"), "a!b!");
    EXPECT_EQ(calls, 2);
    const InlineFunction<int(), 8> count = [n = 0]() mutable { return ++n; };
    count();
    EXPECT_EQ(count(), 2) << "it may change its state";
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
    Ask& same = empty;
    empty = same;
    EXPECT_EQ(empty(3), 3) << "given to itself";
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

}  // namespace
}  // namespace panelgate::memory_test
