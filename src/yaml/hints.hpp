#pragma once

#include <string>
#include <string_view>

#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

// What a person meant by a value of the wrong form, as the end of a message: "; write 500ms". Empty
// when nobody knows.

std::string duration_hint(std::string_view text);
/// `whole`: only a number without a fraction will do.
std::string number_hint(std::string_view text, bool whole);
std::string boolean_hint(const Node& node);
/// A variable of the environment in the form of another program.
std::string variable_hint(std::string_view text);
/// `baud:9600` where `baud` and a value were meant.
std::string blank_hint(std::string_view text);

}  // namespace panelgate::yaml
