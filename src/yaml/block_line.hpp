#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "lint.hpp"

namespace panelgate::yaml {

/// A line outside of brackets and long texts, by what a person sees of it: `- - key: value`.
struct BlockLine {
    std::vector<std::size_t> dashes;  ///< tokens
    std::optional<std::size_t> key;   ///< token, in front of its colon
    std::optional<std::size_t> text;  ///< token: the value, or what stands without a key
    bool has_value() const { return text.has_value(); }
};

std::vector<BlockLine> block_lines(const Scanned& text);

}  // namespace panelgate::yaml
