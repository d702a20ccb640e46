#include "panelgate/base/pool.hpp"

#include <array>
#include <bit>
#include <cstddef>
#include <new>

#if defined(__SANITIZE_ADDRESS__)
#define PANELGATE_PLAIN_HEAP 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define PANELGATE_PLAIN_HEAP 1
#endif
#endif
#ifndef PANELGATE_PLAIN_HEAP
#define PANELGATE_PLAIN_HEAP 0
#endif

namespace panelgate::pool {
namespace {

constexpr bool kPlainHeap = PANELGATE_PLAIN_HEAP == 1;

// Size classes grow by kStep up to kFine, then double.
constexpr std::size_t kStep = 16;
constexpr std::size_t kFine = 1024;
constexpr std::size_t kFineSizes = kFine / kStep;
constexpr std::size_t kSizes = kFineSizes + std::countr_zero(kLargest / kFine);

std::size_t index_of(std::size_t size) {
    if (size <= kFine) return (size - 1) / kStep;
    return kFineSizes + static_cast<std::size_t>(std::bit_width((size - 1) / kFine)) - 1;
}
std::size_t size_of(std::size_t index) {
    return index < kFineSizes ? (index + 1) * kStep : kFine << (index - kFineSizes + 1);
}

struct Free {
    Free* next;
};
struct FreeList {
    Free* first = nullptr;
    std::size_t kept = 0;  ///< bytes
};

/// No destructor: blocks may be freed until the very end of the thread.
struct FreeLists {
    std::array<FreeList, kSizes> of;
    bool open = false;  ///< the thread has a ThreadExit that has not run yet
};
constinit thread_local FreeLists free_lists{};

/// At thread exit, returns the kept blocks to the heap; nothing is kept afterwards.
struct ThreadExit {
    ThreadExit() { free_lists.open = true; }
    ~ThreadExit() {
        free_lists.open = false;
        for (FreeList& free_list : free_lists.of) {
            while (free_list.first != nullptr) {
                Free* const block = free_list.first;
                free_list.first = block->next;
                ::operator delete(block);
            }
            free_list.kept = 0;
        }
    }
};

void* take_new(std::size_t index) {
    thread_local const ThreadExit closing;
    static_cast<void>(&closing);
    return ::operator new(size_of(index));
}

}  // namespace

void* take(std::size_t size) {
    if (kPlainHeap || size > kLargest) return ::operator new(size);
    const std::size_t index = index_of(size);
    FreeList& free_list = free_lists.of[index];
    if (free_list.first == nullptr) return take_new(index);
    Free* const block = free_list.first;
    free_list.first = block->next;
    free_list.kept -= size_of(index);
    return block;
}

void give_back(void* block, std::size_t size) noexcept {
    if (kPlainHeap || size > kLargest) return ::operator delete(block);
    const std::size_t index = index_of(size);
    FreeList& free_list = free_lists.of[index];
    if (!free_lists.open || free_list.kept >= kKept) return ::operator delete(block);
    free_list.first = ::new (block) Free{free_list.first};
    free_list.kept += size_of(index);
}

bool keeps_blocks() noexcept { return !kPlainHeap; }

}  // namespace panelgate::pool
