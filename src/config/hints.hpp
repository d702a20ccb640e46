#pragma once

#include <string>
#include <string_view>

#include "panelgate/yaml/document.hpp"

namespace panelgate::config {

// The probable meaning of a malformed address, as the end of a message: "; write 127.0.0.1:502".
// Empty if there is none.

/// For `listen`.
std::string listen_hint(std::string_view typed);
/// For an item of `allow` or another list of networks, `key`.
std::string network_hint(std::string_view typed, std::string_view key);
/// For an item of a list whose words have no blanks: "; a ',' is missing: write [a, b]".
std::string missing_commas(std::string_view typed);
/// For an invalid `device`.
std::string device_hint(std::string_view typed);

/// Returns `serial` as a map of what was typed instead: "9600 8N1" or [9600, 8, N, 1]. Only what
/// was typed; an example if nothing is understood or typed (nullptr).
std::string serial_example(const yaml::Node* typed);

}  // namespace panelgate::config
