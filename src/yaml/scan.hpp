#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace panelgate::yaml {

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
        odd,      ///< begins with a character that cannot begin a text: % @ ` ,
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
