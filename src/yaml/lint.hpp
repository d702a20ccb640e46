#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "encoding.hpp"
#include "source.hpp"

namespace panelgate::yaml {

/// A text and its tokens.
struct Scanned {
    explicit Scanned(const Source& text)
        : source(text), tokens(scan(mask_variables(text.text()))) {}

    std::string_view text(const Token& token) const {
        return source.text().substr(token.begin, token.end - token.begin);
    }
    std::string_view text(std::size_t token) const { return text(tokens[token]); }
    /// Returns the line from this token on, without a comment; cut, as lines may be long.
    std::string_view rest(std::size_t token) const;
    int line(std::size_t token) const { return source.mark(tokens[token].begin).line; }
    /// True if token `i` exists and is on the line of the one before.
    bool follows(std::size_t i) const { return i < tokens.size() && !tokens[i].first; }
    bool follows(std::size_t i, Token::Kind kind) const {
        return follows(i) && tokens[i].kind == kind;
    }

    const Source& source;
    std::vector<Token> tokens;
};

/// Finds what a parser accepts but users do not mean: unclosed quotes that swallow lines,
/// characters that look like blanks. At most one finding for each line.
Findings find_traps(const Scanned& text);
/// Finds probable causes of a parser error, where the mistakes are: a parser often stops lines
/// below. Empty if none is found.
Findings find_causes(const Scanned& text);

/// Returns `bytes`, which have the offsets of the text, with blanks for the tabs on empty lines and
/// lines with only a comment.
std::string without_blank_tabs(const Scanned& text, std::string bytes);

/// True if the indentation of its line cannot be counted in columns.
bool has_wrong_indent(const Scanned& text, const Token& first);
/// Returns what is wrong with a line that has no ': ', but begins like a key; `token` is its first.
std::optional<Finding> missing_colon(const Scanned& text, std::size_t token);

// Each finds one kind of mistake, in the order of the text.
void find_brackets(const Scanned& text, Findings& findings);
/// The first line that is not in the column of its neighbours, and lines that lack a colon.
void find_columns(const Scanned& text, Findings& findings);

}  // namespace panelgate::yaml
