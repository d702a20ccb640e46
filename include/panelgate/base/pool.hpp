#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <new>
#include <set>
#include <utility>
#include <vector>

namespace panelgate {

/// Memory for what comes and goes with every transaction: a block that is given back is kept for
/// the next one of its size, so that a busy gateway asks the heap for nothing. Each thread has its
/// own; a block may be given back by another thread than took it. What is kept is bounded. Larger
/// blocks than kLargest are the heap's, and all of them where AddressSanitizer watches.
namespace pool {

inline constexpr std::size_t kLargest = std::size_t{64} * 1024;  ///< bytes
inline constexpr std::size_t kKept = std::size_t{256} * 1024;    ///< bytes of each size, at most

/// Throws std::bad_alloc as `new` does. `size` > 0; aligned for anything but over-aligned types.
void* take(std::size_t size);
/// A block of take(), with the size that it was taken for.
void give_back(void* block, std::size_t size) noexcept;
/// False where each block is the heap's own: this build is AddressSanitizer's.
bool keeps_blocks() noexcept;

}  // namespace pool

/// For containers whose elements come and go with every transaction.
template <class T>
struct PoolAllocator {
    static_assert(alignof(T) <= __STDCPP_DEFAULT_NEW_ALIGNMENT__);
    using value_type = T;

    PoolAllocator() = default;
    template <class Other>
    // NOLINTNEXTLINE(*-explicit-*): as std::allocator
    PoolAllocator(const PoolAllocator<Other>&) noexcept {}

    T* allocate(std::size_t count) {
        if (count > static_cast<std::size_t>(-1) / sizeof(T)) throw std::bad_array_new_length();
        return static_cast<T*>(pool::take(count * sizeof(T)));
    }
    void deallocate(T* block, std::size_t count) noexcept {
        pool::give_back(block, count * sizeof(T));
    }
    friend bool operator==(const PoolAllocator&, const PoolAllocator&) { return true; }
};

template <class T>
using PoolVector = std::vector<T, PoolAllocator<T>>;
template <class T>
using PoolDeque = std::deque<T, PoolAllocator<T>>;
template <class T>
using PoolList = std::list<T, PoolAllocator<T>>;
template <class Key, class Value, class Less = std::less<Key>>
using PoolMap = std::map<Key, Value, Less, PoolAllocator<std::pair<const Key, Value>>>;
template <class Key>
using PoolSet = std::set<Key, std::less<Key>, PoolAllocator<Key>>;
template <class Key>
using PoolMultiset = std::multiset<Key, std::less<Key>, PoolAllocator<Key>>;

}  // namespace panelgate
