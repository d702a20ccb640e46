#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/yaml/description.hpp"

namespace panelgate::config {

/// Every key that load() asks for, as it asks: what a configuration may have. Not what stands
/// before that: templates, a station's `template`, `x-` keys, merges, variables.
struct Described {
    std::vector<yaml::KeyShape> keys;
    std::vector<yaml::KeyRule> rules;
};
Described describe();

/// Of a template's name, as KeyShape::pattern.
std::string name_pattern();
/// Of these keys one at least is there, and neither null nor an empty list.
std::span<const std::string_view> serving_keys();

/// What is to be said of a key.
struct KeyText {
    std::string_view path;       ///< as KeyShape::path
    std::string_view otherwise;  ///< what it is when it is left out, as a file writes it; or ""
    std::string_view text;
};
/// One of each key of describe() but of those that are required and say all by their name, and of
/// those that it leaves out.
std::span<const KeyText> key_texts();

}  // namespace panelgate::config
