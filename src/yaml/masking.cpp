#include "masking.hpp"

#include <algorithm>

namespace panelgate::yaml {
namespace {

/// What ends a plain value somewhere, and the bytes for it: F5 and above begin no character
/// (RFC 3629, 3).
constexpr std::string_view kMeaning = "{}[],:# ";
constexpr std::string_view kMasks = "\xF5\xF6\xF7\xF8\xF9\xFA\xFB\xFC";
static_assert(kMeaning.size() == kMasks.size());

void exchange(char& c, std::string_view from, std::string_view to) {
    const std::size_t at = from.find(c);
    if (at != std::string_view::npos) c = to[at];
}

}  // namespace

std::string mask_variables(std::string_view text) {
    std::string masked(text);
    std::size_t at = masked.find("${");
    while (at != std::string::npos) {
        // A quote: the brace behind it belongs to something else.
        const std::size_t end = masked.find_first_of("}\"'\r\n", at);
        if (end == std::string::npos) break;
        if (masked[end] == '}') {
            for (std::size_t i = at + 1; i <= end; ++i) exchange(masked[i], kMeaning, kMasks);
        }
        at = masked.find("${", end);  // what stands before it has the same end
    }
    return masked;
}

std::string unmask_variables(std::string text) {
    std::ranges::for_each(text, [](char& c) { exchange(c, kMasks, kMeaning); });
    return text;
}

}  // namespace panelgate::yaml
