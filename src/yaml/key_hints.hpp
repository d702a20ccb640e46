#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "lint.hpp"

namespace panelgate::yaml {

/// Letters, digits, '_' and '-', with a letter first.
bool is_word(std::string_view text);
/// What a line without a ': ' should have been, if it began with a key; the line's first token.
std::optional<Finding> missing_colon(const Scanned& text, std::size_t token);
/// `listen: 127.0.0.1: 502`, `serial: baud: 9600`, `name: press profile: x`: what is wrong and what
/// would be right. Tokens of one line.
std::string second_colon(const Scanned& text, std::size_t key, std::size_t value);

}  // namespace panelgate::yaml
