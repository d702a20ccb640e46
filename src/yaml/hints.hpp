#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "lint.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

// What a person meant by a value of the wrong form, as the end of a message: "; write 500ms". Empty
// when nobody knows.

std::string duration_hint(std::string_view text);
/// "; it is the value of ${BAUD}: ..." for a value that a variable brought, unless the message says
/// so already; else "".
std::string origin_hint(const Node& node, std::string_view told);
/// `whole`: only a number without a fraction will do.
std::string number_hint(std::string_view text, bool whole);
std::string boolean_hint(const Node& node);
/// A variable of the environment in the form of another program.
std::string variable_hint(std::string_view text);
/// A list (`[`) or a map (`{`) that is a text, by quotes or out of a variable.
std::string text_hint(const Node& node, char opening);
/// `http: off`, where the example of a map has no "off".
std::string none_hint(std::string_view key, std::string_view example, const Node& node);
/// `baud:9600` or `baud=9600` where `baud` and a value were meant.
std::string blank_hint(std::string_view text);

/// Letters, digits, '_' and '-', with a letter first.
bool is_word(std::string_view text);
/// What a line without a ': ' should have been, if it began with a key; the line's first token.
std::optional<Finding> missing_colon(const Scanned& text, std::size_t token);
/// `listen: 127.0.0.1: 502`, `serial: baud: 9600`, `name: press profile: x`: what is wrong and what
/// would be right. Tokens of one line.
std::string second_colon(const Scanned& text, std::size_t key, std::size_t value);

}  // namespace panelgate::yaml
