#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace panelgate::points {

/// The text in these registers, high byte first: up to the first NUL, at most `length` bytes,
/// without blanks at its end. What is not UTF-8 becomes U+FFFD, so that it can go into JSON.
std::string text_of_words(const std::vector<std::uint16_t>& words, unsigned length);

/// Filled up with NUL. The text fits.
std::vector<std::uint16_t> text_to_words(std::string_view text, unsigned count);

/// "NaN", "-inf", "Infinity", however it is written.
bool is_no_number(std::string text);

}  // namespace panelgate::points
