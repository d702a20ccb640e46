#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace panelgate::yaml {

/// A piece of YAML as a person means it, told from the text alone: also where the text is broken.
struct Token {
    enum class Kind : std::uint8_t {
        dash,     ///< "- "
        colon,    ///< ": "
        comma,    ///< inside brackets
        open,     ///< [ or {
        close,    ///< ] or }
        plain,    ///< a text without quotes, to the end of its line at most
        quoted,   ///< with its quotes
        block,    ///< | or > with all its lines
        alias,    ///< *name
        anchor,   ///< &name
        tag,      ///< !name
        odd,      ///< begins with a character that begins no text: % @ ` ,
        document  ///< --- or ...
    };
    /// unclosed: an `open` or a `quoted`; stray: a `close` of nothing, a `dash` that is another
    /// character.
    enum class State : std::uint8_t { fine, unclosed, stray };

    Kind kind = Kind::plain;
    State state = State::fine;
    bool first = false;     ///< of its line, but for blanks
    std::size_t depth = 0;  ///< brackets that are open; before one, at its end with itself
    std::size_t begin = 0;  ///< offsets
    std::size_t end = 0;
};

/// The tokens of a text, at most so many that the limits of settings.hpp are reached before.
/// Comments and directives are left out. What a forgotten bracket would swallow is read as if it
/// had been closed at the end of its line; a forgotten quote, where a person would have closed it.
std::vector<Token> scan(std::string_view text);

/// Where the line of an offset begins.
std::size_t line_begin(std::string_view text, std::size_t offset);

}  // namespace panelgate::yaml
