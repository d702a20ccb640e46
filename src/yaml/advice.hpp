#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "encoding.hpp"

namespace panelgate::yaml {

/// A line with text, outside of quotes and block texts, as its author reads it.
struct TextLine {
    std::size_t begin = 0;  ///< offset of the line
    std::size_t at = 0;     ///< offset of its first character that is no blank
    std::size_t end = 0;    ///< offset behind its last character but a comment
    std::size_t depth = 0;  ///< brackets that are open before the line
};

/// The lines of a text that need not be YAML, and the quotes and brackets that do not fit.
struct Lines {
    explicit Lines(std::string_view masked);

    std::vector<TextLine> all;
    Findings quotes;                      ///< quotes that are never closed
    Findings brackets;                    ///< brackets without their other half
    std::optional<std::size_t> too_deep;  ///< the bracket that exceeds kMaxDepth
};

/// Finds what a parser accepts and no user means: quotes that swallow lines, characters that look
/// like blanks, tabs in the indentation. `text` is decoded. At most one finding for each line.
Findings find_traps(std::string_view text, const Lines& lines);
/// Finds probable causes of a parser's error at the offset `error`, at the mistake: a parser often
/// stops lines below. Empty: no cause is known.
/// `sections`: keys of the outermost map.
Findings find_causes(std::string_view text, const Lines& lines, std::size_t error,
                     std::span<const std::string_view> sections = {});

/// On which lines a slip is looked for.
enum class On : std::uint8_t {
    any,      ///< also of a text that the parser takes
    refused,  ///< of a refused text
    odd,      ///< of a refused text, where the line is neither a key nor an item
};

/// Returns the finding of the first slip of such lines that fits the text at `at`.
std::optional<Finding> slip_of(std::string_view line, std::size_t at, On on);

/// Returns `bytes`, which have the offsets of the text, with blanks for the tabs on empty lines and
/// on lines with only a comment.
std::string without_blank_tabs(std::string bytes);

}  // namespace panelgate::yaml
