#pragma once

#include <cstddef>

namespace panelgate::config {

/// Limits for what templates add to all stations together: a short file must not use much memory.
inline constexpr std::size_t kMaxTemplateValues = 500'000;
inline constexpr std::size_t kMaxTemplateText = 16 * 1024 * 1024;  ///< bytes of keys and scalars

/// Shorter tokens cause a warning: 16 hexadecimal digits are 64 bits.
inline constexpr std::size_t kShortToken = 16;

}  // namespace panelgate::config
