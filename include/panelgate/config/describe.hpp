#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/yaml/description.hpp"

namespace panelgate::config {

struct Setting;

/// What changes of some keys need beside a reload.
inline constexpr std::string_view kOpensPort = "the port is opened anew";
inline constexpr std::string_view kListensAnew = "it listens anew, and its clients connect again";
inline constexpr std::string_view kConnectsAnew = "it connects to the broker anew";
inline constexpr std::string_view kAllowCloses = "clients outside `allow` are closed";
inline constexpr std::string_view kTlsCloses = "clients that are not let in any more are closed";
inline constexpr std::string_view kTlsRenewed = "for connections to come";
/// The change of a key that a reload cannot take over (KeyShape::change).
inline constexpr std::string_view kNextStart = "takes effect at the next start";

/// Every key that load() reads, in that order: what a configuration may have. Without what is
/// resolved earlier: templates, a station's `template`, `x-` keys, merges, variables.
struct Described {
    std::vector<yaml::KeyShape> keys;
    std::vector<yaml::KeyRule> rules;

    /// nullptr: there is none at this path.
    const yaml::KeyShape* find(std::string_view path) const;
    /// The key of a setting, or the map or list that it is in; nullptr: none.
    const yaml::KeyShape* of(const Setting& setting) const;
    /// "only with mode: kernel or rts", "not with type: bool", of a key whose presence depends on a
    /// neighbour; "" none.
    std::string condition_of(std::string_view key) const;

    std::map<std::string, std::size_t, std::less<>> places = {};  ///< in `keys`, by path
};
/// Made once, at the first call.
const Described& describe();

/// Returns the pattern of a template's name, as in KeyShape::pattern.
std::string name_pattern();
/// Returns the keys of which at least one must be present, neither null nor an empty list.
std::span<const std::string_view> serving_keys();

}  // namespace panelgate::config
