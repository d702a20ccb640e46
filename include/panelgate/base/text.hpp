#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace panelgate {

/// A number as people write it: the shortest decimal that reads back as the same number. Whole
/// numbers have no point ("3"), zero no sign; an exponent only from 1e16 on and below 0.0001.
/// "" for what is not finite.
std::string number_text(double value);
/// Of a float its own digits: "0.1", where number_text(double) of it tells 0.10000000149011612.
std::string number_text(float value);

/// The double that is nearest to what a float prints: 0.1 of 0.1F.
double as_printed(float value);

/// Bytes of the UTF-8 sequence that `text` begins with, 0 when it begins with none (RFC 3629, 4).
std::size_t utf8_sequence(std::string_view text);
bool is_utf8(std::string_view text);
/// Bytes of the byte order mark that the text begins with: 3, or 0. Editors put it in front.
std::size_t byte_order_mark(std::string_view text);
/// U+FFFD in the place of every byte that belongs to no character.
std::string as_utf8(std::string_view bytes);

/// The candidate that was probably meant by `typed`: the same letters and digits ("Panasonic GT"),
/// another trade's word for it (baudrate, float), or the nearest by edit distance; "" when none is
/// near (more than 2 edits, or more than a third of the longer word).
std::string nearest(std::string_view typed, std::span<const std::string_view> candidates);

}  // namespace panelgate
