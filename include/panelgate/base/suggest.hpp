#pragma once

#include <span>
#include <string>
#include <string_view>

namespace panelgate {

/// The candidate that was probably meant by `typed`: the nearest by edit distance, or "" when none
/// is near (more than 2 edits, or more than a third of the longer word).
std::string nearest(std::string_view typed, std::span<const std::string_view> candidates);

}  // namespace panelgate
