#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>

#include "panelgate/base/bytes.hpp"

namespace panelgate {

/// "07 03 00 01"_hex; a literal that is not hex throws.
inline Bytes operator""_hex(const char* text, std::size_t size) {
    const std::string_view literal(text, size);
    std::optional<Bytes> bytes = from_hex(literal);
    if (!bytes) throw std::invalid_argument("not hex: " + std::string(literal));
    return *bytes;
}

}  // namespace panelgate
