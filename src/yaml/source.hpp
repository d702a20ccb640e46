#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

/// Replaces special characters of `${NAME:-default}` by bytes without a meaning to a YAML parser,
/// which no UTF-8 text has: between { and } its braces would end the list or map. The length stays,
/// so marks remain valid.
std::string mask_variables(std::string_view text);
/// Restores text that was masked.
std::string unmask_variables(std::string text);

/// A decoded text and its lines. Columns count characters, as editors do; yaml-cpp counts bytes.
class Source {
  public:
    explicit Source(std::string all);

    std::string_view text() const { return text_; }
    /// Returns the mark of an offset; the end of the text if it is beyond.
    Mark mark(std::size_t offset) const;
    /// Converts a place of yaml-cpp: from 0, the column in bytes.
    Mark mark(int line, int column) const;
    /// Returns a line (from 1) without its end; empty if there is none.
    std::string_view line(int number) const;
    /// Returns the byte at a place of yaml-cpp; '\n' beyond the end.
    char byte(int line, int column) const;
    /// Returns the line and a `^` below the column, each ended by '\n'; a long line is cut around
    /// it.
    std::string excerpt(Mark mark) const;

  private:
    std::size_t characters(std::size_t from, std::size_t to) const;

    std::string text_;
    std::vector<std::size_t> lines_;   ///< where each begins
    std::vector<std::size_t> inside_;  ///< continuation bytes before each 64th byte
};

/// A YAML token as a user means it, found without a grammar: also in invalid text.
struct Token {
    enum class Kind : std::uint8_t {
        dash,     ///< "- "
        colon,    ///< ": "
        comma,    ///< inside brackets
        open,     ///< [ or {
        close,    ///< ] or }
        plain,    ///< an unquoted text, at most to the end of its line
        quoted,   ///< with its quotes
        block,    ///< | or > with all its lines
        alias,    ///< *name
        anchor,   ///< &name
        tag,      ///< !name
        odd,      ///< begins with what cannot begin a text: % @ ` , {{
        document  ///< --- or ...
    };
    /// unclosed: an `open` or a `quoted`; stray: an unmatched `close`, a `dash` that is another
    /// character.
    enum class State : std::uint8_t { fine, unclosed, stray };

    Kind kind = Kind::plain;
    State state = State::fine;
    bool first = false;     ///< first of its line
    std::size_t depth = 0;  ///< open brackets; an `open` does not count itself, a `close` does
    std::size_t begin = 0;  ///< offsets
    std::size_t end = 0;
};

/// Returns the tokens of a text, without comments and directives; their number is bounded above the
/// limits of settings.hpp. An unclosed bracket ends before the line that cannot be inside it; an
/// unclosed quote, where a user would have closed it.
std::vector<Token> scan(std::string_view text);

/// Returns where the line of an offset begins.
std::size_t line_begin(std::string_view text, std::size_t offset);

}  // namespace panelgate::yaml
