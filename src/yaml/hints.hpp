#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

// The probable meaning of a malformed value, as the end of a message: "; write 500ms". Empty if
// there is none.

std::string duration_hint(std::string_view text);
/// `whole`: only numbers without a fraction are allowed.
std::string number_hint(std::string_view text, bool whole);
std::string boolean_hint(const Node& node);
/// Returns "; it is the value of ${BAUD}: ..." for a value from a variable, unless the message says
/// so already.
std::string origin_hint(const Node& node, std::string_view told);
/// For a list (`[`) or a map (`{`) that is a text, in quotes or from a variable.
std::string text_hint(const Node& node, char opening);
/// For `http: off`, if the map's example has no "off".
std::string none_hint(std::string_view key, std::string_view example, const Node& node);
/// For `baud:9600` or `baud=9600`, where a key and a value were meant.
std::string blank_hint(std::string_view text);

/// Parses a number, all of the text; nothing for one that is not finite.
std::optional<double> parse_number(std::string_view text);

}  // namespace panelgate::yaml
