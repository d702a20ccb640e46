#include "panelgate/yaml/quote.hpp"

#include "encoding.hpp"

#include <algorithm>
#include <cstddef>

namespace panelgate::yaml {

std::string quote(std::string_view text) {
    constexpr std::size_t kMost = 80;
    std::string shown(clip(text, kMost));
    const bool is_cut = shown.size() < text.size();
    std::ranges::replace_if(shown, [](char c) { return (c >= 0 && c < ' ') || c == 0x7F; }, ' ');
    const char mark = shown.find('\'') == shown.npos || shown.find('"') != shown.npos ? '\'' : '"';
    return mark + shown + (is_cut ? "..." : "") + mark;
}

}  // namespace panelgate::yaml
