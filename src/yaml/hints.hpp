#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "lint.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

// The probable meaning of a malformed value, as the end of a message: "; write 500ms". Empty if
// there is none.

std::string duration_hint(std::string_view text);
/// Returns "; it is the value of ${BAUD}: ..." for a value from a variable, unless the message says
/// so already; else "".
std::string origin_hint(const Node& node, std::string_view told);
/// `whole`: only numbers without a fraction are allowed.
std::string number_hint(std::string_view text, bool whole);
std::string boolean_hint(const Node& node);
/// For an environment variable in another program's notation.
std::string variable_hint(std::string_view text);
/// For a list (`[`) or a map (`{`) that is a text, in quotes or from a variable.
std::string text_hint(const Node& node, char opening);
/// For `http: off`, if the map's example has no "off".
std::string none_hint(std::string_view key, std::string_view example, const Node& node);
/// For `baud:9600` or `baud=9600`, where `baud` and a value were meant.
std::string blank_hint(std::string_view text);

/// Parses a number, all of the text; nothing for one that is not finite.
std::optional<double> parse_number(std::string_view text);
/// True for letters, digits, '_' and '-', with a letter first.
bool is_word(std::string_view text);
/// Returns how to correct a line without ': ' that begins like a key; `token` is its first.
std::optional<Finding> missing_colon(const Scanned& text, std::size_t token);
/// Returns the fault and the correction of `listen: 127.0.0.1: 502`, `serial: baud: 9600`, `name:
/// press profile: x`. Tokens of one line.
std::string second_colon(const Scanned& text, std::size_t key, std::size_t value);

}  // namespace panelgate::yaml
