#pragma once

#include <charconv>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>

namespace panelgate {

/// Formats the shortest decimal that reads back as the same number. Whole numbers have no point
/// ("3"), zero no sign; an exponent only from 1e16 and below 0.0001. "" for a value that is not
/// finite.
std::string number_text(double value);
/// The shortest digits of a float: "0.1", where number_text(double) gives 0.10000000149011612.
std::string number_text(float value);

/// Returns the double nearest to the float's shortest decimal: 0.1 for 0.1F.
double as_printed(float value);

/// Parses the whole text as an unsigned number of this base; nullopt on failure.
template <class Number = unsigned>
std::optional<Number> to_number(std::string_view text, int base = 10) {
    Number number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return number;
}

/// Length in bytes of the UTF-8 sequence at the start of `text`; 0 if there is none (RFC 3629, 4).
std::size_t utf8_sequence(std::string_view text);
bool is_utf8(std::string_view text);
/// Length of the byte order mark at the start of the text, which some editors add: 3, or 0.
std::size_t byte_order_mark(std::string_view text);
/// Replaces every byte that belongs to no character with U+FFFD.
std::string as_utf8(std::string_view bytes);

/// True for a control character of ASCII: below a blank, or DEL.
constexpr bool is_control(char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f'; }

/// With small ASCII letters.
std::string to_lower(std::string_view text);

/// Without the spaces and tabs at both ends (OWS, RFC 9110, 5.6.3).
std::string_view trimmed(std::string_view text);

/// Returns the candidate that `typed` most likely means: same letters and digits ("Panasonic GT"),
/// a synonym (baudrate, float), or the nearest by edit distance; "" if none is near (more than 2
/// edits, or more than a third of the longer word).
std::string nearest(std::string_view typed, std::span<const std::string_view> candidates);

/// Text of another program for a terminal: UTF-8, control characters as '?'.
std::string printable(std::string_view text);

}  // namespace panelgate
