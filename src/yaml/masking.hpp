#pragma once

#include <string>
#include <string_view>

namespace panelgate::yaml {

/// Between { and } the braces of `${NAME:-default}` would end the list or map around it. Masked,
/// it has bytes instead that mean nothing to a YAML parser and that no UTF-8 text has; the length
/// is the same, so marks stay true.
std::string mask_variables(std::string_view text);
/// What was written, of a text that came out of a masked one.
std::string unmask_variables(std::string text);

}  // namespace panelgate::yaml
