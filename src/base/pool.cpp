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

// Sizes rise by kStep to kFine, and double from there on.
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
struct Shelf {
    Free* first = nullptr;
    std::size_t kept = 0;  ///< bytes
};

/// Without a destructor of its own: blocks come back until the thread's very end.
struct Shelves {
    std::array<Shelf, kSizes> of;
    bool open = false;  ///< the thread has a Closing, and it has not come yet
};
constinit thread_local Shelves shelves{};

/// At the end of a thread what is kept goes back to the heap, and nothing is kept any more.
struct Closing {
    Closing() { shelves.open = true; }
    ~Closing() {
        shelves.open = false;
        for (Shelf& shelf : shelves.of) {
            while (shelf.first != nullptr) {
                Free* const block = shelf.first;
                shelf.first = block->next;
                ::operator delete(block);
            }
            shelf.kept = 0;
        }
    }
};

void* take_new(std::size_t index) {
    thread_local const Closing closing;
    static_cast<void>(&closing);
    return ::operator new(size_of(index));
}

}  // namespace

void* take(std::size_t size) {
    if (kPlainHeap || size > kLargest) return ::operator new(size);
    const std::size_t index = index_of(size);
    Shelf& shelf = shelves.of[index];
    if (shelf.first == nullptr) return take_new(index);
    Free* const block = shelf.first;
    shelf.first = block->next;
    shelf.kept -= size_of(index);
    return block;
}

void give_back(void* block, std::size_t size) noexcept {
    if (kPlainHeap || size > kLargest) return ::operator delete(block);
    const std::size_t index = index_of(size);
    Shelf& shelf = shelves.of[index];
    if (!shelves.open || shelf.kept >= kKept) return ::operator delete(block);
    shelf.first = ::new (block) Free{shelf.first};
    shelf.kept += size_of(index);
}

bool keeps_blocks() noexcept { return !kPlainHeap; }

}  // namespace panelgate::pool
