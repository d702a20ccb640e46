#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace panelgate {

/// Bytes of the UTF-8 sequence that `text` begins with, 0 when it begins with none (RFC 3629, 4).
std::size_t utf8_sequence(std::string_view text);
bool is_utf8(std::string_view text);
/// Bytes of the byte order mark that the text begins with: 3, or 0. Editors put it in front.
std::size_t byte_order_mark(std::string_view text);
/// U+FFFD in the place of every byte that belongs to no character.
std::string as_utf8(std::string_view bytes);

}  // namespace panelgate
