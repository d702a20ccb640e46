#pragma once

#include <span>
#include <string>
#include <string_view>

namespace panelgate {

/// The candidate that was probably meant by `typed`: the same letters and digits ("Panasonic GT"),
/// another trade's word for it (baudrate, float), or the nearest by edit distance; "" when none is
/// near (more than 2 edits, or more than a third of the longer word).
std::string nearest(std::string_view typed, std::span<const std::string_view> candidates);

}  // namespace panelgate
