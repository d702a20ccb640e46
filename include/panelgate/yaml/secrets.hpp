#pragma once

#include <string_view>

#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

/// Takes what follows `password`, `token`, `secret` and the like in the file's text out of its
/// problems' messages: they go to the log, and to whoever may ask what came of a reload. A secret
/// does not belong there, but with a slip it is no value of a key that could be told as one.
void conceal_secrets(std::string_view text, Problems& problems);

}  // namespace panelgate::yaml
