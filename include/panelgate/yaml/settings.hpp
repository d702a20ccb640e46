#pragma once

#include <cstddef>

namespace panelgate::yaml {

/// Levels of lists and maps, aliases included.
constexpr std::size_t kMaxDepth = 64;
/// Values of one document. The copy kept for an anchor and each repetition by an alias count again.
constexpr std::size_t kMaxNodes = 500'000;
/// Bytes of all texts and keys of one document, counted in the same way. Both limits bound what a
/// file can expand to.
constexpr std::size_t kMaxText = 4 * 1024 * 1024;
/// Problems shown by one run; the rest is only counted.
constexpr std::size_t kMaxShown = 50;

}  // namespace panelgate::yaml
