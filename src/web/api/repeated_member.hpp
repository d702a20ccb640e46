#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace panelgate::web {

struct RepeatedMember {
    std::string name;
    std::size_t at = 0;  ///< where the second one begins, in the text
};

/// The first member that an object in this text has twice, at any depth: parsers of values keep the
/// last one and say nothing. Of a text that is no JSON: what is found before its fault.
std::optional<RepeatedMember> find_repeated_member(std::string_view json);

}  // namespace panelgate::web
