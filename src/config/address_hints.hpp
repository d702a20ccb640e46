#pragma once

#include <string>
#include <string_view>

namespace panelgate::config {

// What a person meant by an address of the wrong form, as the end of a message: "; write
// 127.0.0.1:502". Empty when nobody knows.

/// Of `listen`.
std::string listen_hint(std::string_view typed);
/// Of an item of `allow`.
std::string network_hint(std::string_view typed);
/// Of an item of a list whose words hold no blanks: "; a ',' is missing: write [a, b]".
std::string missing_commas(std::string_view typed);

}  // namespace panelgate::config
