#pragma once

#include <string>
#include <string_view>

namespace panelgate::web {

/// ASCII only: what HTTP compares without case is nothing else.
inline std::string to_lower(std::string_view text) {
    std::string lower(text);
    for (char& c : lower) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    }
    return lower;
}

}  // namespace panelgate::web
