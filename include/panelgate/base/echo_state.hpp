#pragma once

#include <cstdint>
#include <string_view>

namespace panelgate {

/// Whether the adapter hears what it sends, as the configuration says it (P8).
enum class EchoMode : std::uint8_t {
    automatic,  ///< learned from reads, before the first write
    on,
    off,
};

/// What is known of it.
enum class EchoState : std::uint8_t {
    unknown,
    absent,
    present,
    unclear,  ///< a part of a read came back in front of its answer: whole echoes may come
};
std::string_view label(EchoState state);

}  // namespace panelgate
