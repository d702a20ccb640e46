#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/yaml/description.hpp"

namespace panelgate::config {

/// What changes of some keys need beside a reload.
inline constexpr std::string_view kOpensPort = "the port is opened anew";
inline constexpr std::string_view kListensAnew = "it listens anew, and its clients connect again";
inline constexpr std::string_view kConnectsAnew = "it connects to the broker anew";
inline constexpr std::string_view kAllowCloses = "clients outside `allow` are closed";
/// The change of a key that a reload cannot take over (KeyShape::change).
inline constexpr std::string_view kNextStart = "takes effect at the next start";

/// Every key that load() reads, in that order: what a configuration may have. Without what is
/// resolved earlier: templates, a station's `template`, `x-` keys, merges, variables.
struct Described {
    std::vector<yaml::KeyShape> keys;
    std::vector<yaml::KeyRule> rules;

    /// The key of a setting's path (Setting::path), or the deepest map above it; nullptr: none.
    const yaml::KeyShape* find(std::string_view setting) const;

    /// What a change of a setting (Setting::path) needs beside a reload; "" nothing.
    std::string_view change_of(std::string_view setting) const;
    /// "only with mode: kernel or rts", "not with type: bool", of a key whose presence depends on a
    /// neighbour; "" none.
    std::string condition_of(std::string_view key) const;
};
/// Made once, at the first call.
const Described& describe();

/// Returns the pattern of a template's name, as in KeyShape::pattern.
std::string name_pattern();
/// Returns the keys of which at least one must be present, neither null nor an empty list.
std::span<const std::string_view> serving_keys();

}  // namespace panelgate::config
