#pragma once

#include <string>
#include <string_view>

namespace panelgate::yaml {

/// What a refusal of yaml-cpp means to who wrote the text, for what the lints do not explain.
std::string in_our_words(std::string_view refusal);

}  // namespace panelgate::yaml
