#pragma once

#include <cstddef>
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
    /// Returns the rest of the line from this token on, without a comment, and with the blanks
    /// between tokens.
    std::string_view rest(std::size_t token) const;
    /// Counts characters from 0.
    std::size_t column(const Token& token) const {
        return static_cast<std::size_t>(source.mark(token.begin).column) - 1;
    }
    int line(const Token& token) const { return source.mark(token.begin).line; }
    /// True if token `i` exists and is on the line of the one before.
    bool follows(std::size_t i) const { return i < tokens.size() && !tokens[i].first; }

    const Source& source;
    std::vector<Token> tokens;
};

/// Finds what a parser accepts but users do not mean: unclosed quotes that swallow lines,
/// characters that look like blanks. At most one finding for each line.
Findings find_traps(const Scanned& text);
/// Finds probable causes of a parser error, where the mistakes are: a parser often stops lines
/// below. Empty if none is found.
Findings find_causes(const Scanned& text);

/// True if the indentation of its line cannot be counted in columns.
bool has_wrong_indent(const Scanned& text, const Token& first);

/// Returns the fault and the correction of `127.0.0.1: 502`, whose first part is `word`; empty if
/// it is no address.
std::string address_hint(std::string_view word, std::string_view all);

/// `*name` allows no keys beside it: returns how to write it with the keys `more`.
std::string alias_and_more(std::string_view alias, std::string_view more);

/// Returns `bytes`, which have the offsets of the text, with blanks for the tabs on empty lines and
/// lines with only a comment.
std::string without_blank_tabs(const Scanned& text, std::string bytes);

// Each finds one kind of mistake, in the order of the text.
void find_open_quotes(const Scanned& text, Findings& findings);
void find_wrong_blanks(const Scanned& text, Findings& findings);
void find_wrong_dashes(const Scanned& text, Findings& findings);
void find_typeset_quotes(const Scanned& text, Findings& findings);
void find_quote_ends(const Scanned& text, Findings& findings);
void find_placeholders(const Scanned& text, Findings& findings);
void find_brackets(const Scanned& text, Findings& findings);
void find_directives(const Scanned& text, Findings& findings);
void find_wrong_starts(const Scanned& text, Findings& findings);
void find_columns(const Scanned& text, Findings& findings);

}  // namespace panelgate::yaml
