#include "counting.hpp"

#include <execinfo.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <new>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PANELGATE_COUNTS 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define PANELGATE_COUNTS 0
#endif
#endif
#ifndef PANELGATE_COUNTS
#define PANELGATE_COUNTS 1
#endif

namespace panelgate::test {
namespace {

constinit thread_local std::uint64_t counted = 0;
constinit thread_local bool watching = false;

[[maybe_unused]] void show() {
    static const bool wanted = std::getenv("PANELGATE_SHOW_NEW") != nullptr;
    if (!wanted || !watching) return;
    std::array<void*, 24> frames{};
    const int depth = ::backtrace(frames.data(), static_cast<int>(frames.size()));
    ::backtrace_symbols_fd(frames.data(), depth, STDERR_FILENO);
    [[maybe_unused]] const auto said = ::write(STDERR_FILENO, "\n", 1);
}

}  // namespace

std::uint64_t allocations() { return counted; }
void watch_allocations(bool watch) { watching = watch; }
bool counts_allocations() { return PANELGATE_COUNTS != 0; }

#if PANELGATE_COUNTS
[[nodiscard]] static void* count_new(std::size_t size) {
    ++counted;
    show();
    if (void* const block = std::malloc(size == 0 ? 1 : size)) return block;
    throw std::bad_alloc();
}
#endif

}  // namespace panelgate::test

#if PANELGATE_COUNTS
void* operator new(std::size_t size) { return panelgate::test::count_new(size); }
void* operator new[](std::size_t size) { return panelgate::test::count_new(size); }
void operator delete(void* block) noexcept { std::free(block); }
void operator delete[](void* block) noexcept { std::free(block); }
void operator delete(void* block, std::size_t) noexcept { std::free(block); }
void operator delete[](void* block, std::size_t) noexcept { std::free(block); }
#endif
