#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace panelgate::web {

/// A request target in its origin form: "/a/b%20c?x=1".
struct Target {
    std::vector<std::string> path;
    std::map<std::string, std::string> query;  ///< of equal names the first
    std::string repeated_query;                ///< a name that comes more than once; "" for none
};
/// Nothing when it does not start with '/' or has a broken percent-encoding.
std::optional<Target> parse_target(std::string_view target);

}  // namespace panelgate::web
