#include "panelgate/base/pool.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <set>
#include <thread>
#include <utility>
#include <vector>

namespace panelgate::pool_test {
namespace {

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

TEST(Pool, KeepsNoMoreThanItsLimit) {
    std::vector<void*> blocks;
    for (std::size_t taken = 0; taken < 4 * pool::kKept; taken += 512)
        blocks.push_back(pool::take(512));
    for (void* block : blocks) pool::give_back(block, 512);
    std::set<void*> kept;
    for (std::size_t i = 0; i < blocks.size(); ++i) kept.insert(pool::take(512));
    EXPECT_EQ(kept.size(), blocks.size());
    for (void* block : kept) pool::give_back(block, 512);
}

TEST(Pool, ContainersGrowAndShrinkInIt) {
    PoolMap<int, PoolVector<int>> lists;
    PoolDeque<int> queue;
    for (int i = 0; i < 2000; ++i) {
        lists[i % 50].push_back(i);
        queue.push_back(i);
        if (i % 3 == 0) lists.erase(i % 7);
        if (i % 2 == 0) queue.pop_front();
    }
    EXPECT_EQ(queue.size(), 1000u);
    EXPECT_EQ(queue.front(), 1000);
    EXPECT_EQ(lists.at(49).back(), 1999);
}

}  // namespace
}  // namespace panelgate::pool_test
