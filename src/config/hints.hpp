#pragma once

#include <string>
#include <string_view>

#include "panelgate/yaml/document.hpp"

namespace panelgate::config {

// What a person meant by an address of the wrong form, as the end of a message: "; write
// 127.0.0.1:502". Empty when nobody knows.

/// Of `listen`.
std::string listen_hint(std::string_view typed);
/// Of an item of `allow`.
std::string network_hint(std::string_view typed);
/// Of an item of a list whose words hold no blanks: "; a ',' is missing: write [a, b]".
std::string missing_commas(std::string_view typed);

/// `serial` as a map, of what was typed in its place: "9600 8N1" or [9600, 8, N, 1]. Only what was
/// typed; an example when nothing of it is understood, or nothing was typed (nullptr).
std::string serial_example(const yaml::Node* typed);
/// What a person meant by a `device` that is none, as the end of a message. Empty when nobody
/// knows.
std::string device_hint(std::string_view typed);

}  // namespace panelgate::config
