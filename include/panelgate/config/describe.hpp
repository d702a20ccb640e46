#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/yaml/description.hpp"

namespace panelgate::config {

/// The change of a key that a reload cannot take over (KeyShape::change).
inline constexpr std::string_view kNextStart = "takes effect at the next start";

/// Every key that load() reads, in that order: what a configuration may have. Without what is
/// resolved earlier: templates, a station's `template`, `x-` keys, merges, variables.
struct Described {
    std::vector<yaml::KeyShape> keys;
    std::vector<yaml::KeyRule> rules;

    /// What a change of a setting (Setting::path) needs beside a reload; "" nothing.
    std::string_view change_of(std::string_view setting) const;
};
/// Made once, at the first call.
const Described& describe();

/// Returns the pattern of a template's name, as in KeyShape::pattern.
std::string name_pattern();
/// Returns the keys of which at least one must be present, neither null nor an empty list.
std::span<const std::string_view> serving_keys();

}  // namespace panelgate::config
