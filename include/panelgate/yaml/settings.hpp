#pragma once

#include <cstddef>

namespace panelgate::yaml {

/// Levels of lists and maps, aliases included.
constexpr std::size_t kMaxDepth = 64;
/// Values of one document. What an anchor keeps and what an alias repeats counts again.
constexpr std::size_t kMaxNodes = 500'000;
/// Bytes of all texts and keys of one document, counted in the same way: with the values, what a
/// file of any size can make of itself.
constexpr std::size_t kMaxText = 4 * 1024 * 1024;
/// Problems that are shown of one run; the others are counted.
constexpr std::size_t kMaxTold = 50;

}  // namespace panelgate::yaml
