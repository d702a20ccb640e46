#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace panelgate::web {

/// A request target in its origin form, "/a/b%20c?x=1", or its absolute form, "http://host/a" (RFC
/// 9112 3.2).
struct Target {
    std::vector<std::string> path;
    std::multimap<std::string, std::string> query;  ///< decoded, repetitions included
    std::optional<std::string> authority;           ///< of an absolute one: "host:80"
};
/// Nothing when it has another form, a broken percent-encoding, or decodes to what is not UTF-8.
std::optional<Target> parse_target(std::string_view target);

}  // namespace panelgate::web
