#pragma once

#include <string>
#include <string_view>

namespace panelgate::yaml {

/// A text of a file in a message of one line: in quotes, cut after 80 bytes, without control
/// characters.
std::string quote(std::string_view text);

}  // namespace panelgate::yaml
