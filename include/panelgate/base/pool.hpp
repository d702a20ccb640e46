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

/// Memory for objects that live for one transaction: a freed block is kept for the next request of
/// its size, so that a busy gateway does not use the heap. Each thread has its own pool; a block
/// may be freed by another thread than took it. The kept memory is bounded. Blocks larger than
/// kLargest come from the heap; under AddressSanitizer all do.
namespace pool {

inline constexpr std::size_t kLargest = std::size_t{64} * 1024;  ///< bytes
inline constexpr std::size_t kKept = std::size_t{256} * 1024;    ///< bytes kept per size, at most

/// Allocates `size` > 0 bytes, aligned for any type that is not over-aligned. Throws
/// std::bad_alloc.
void* take(std::size_t size);
/// Frees a block from take(); `size` as passed to take().
void give_back(void* block, std::size_t size) noexcept;
/// False if every block comes from the heap (AddressSanitizer builds).
bool keeps_blocks() noexcept;

}  // namespace pool

/// Allocator for containers whose elements live for one transaction.
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
