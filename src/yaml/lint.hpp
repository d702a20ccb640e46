#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "encoding.hpp"
#include "scan.hpp"
#include "source.hpp"

namespace panelgate::yaml {

/// A text and its tokens.
struct Scanned {
    explicit Scanned(const Source& text)
        : source(text), tokens(scan(mask_variables(text.text()))) {}

    std::string_view text(const Token& token) const {
        return source.text().substr(token.begin, token.end - token.begin);
    }
    /// The rest of the token's line from its begin: without a comment, and with the blanks between
    /// tokens as they are.
    std::string_view rest(std::size_t token) const;
    /// From 0, in characters.
    std::size_t column(const Token& token) const {
        return static_cast<std::size_t>(source.mark(token.begin).column) - 1;
    }
    int line(const Token& token) const { return source.mark(token.begin).line; }
    /// Token `i` exists and stands on the line of the one before.
    bool follows(std::size_t i) const { return i < tokens.size() && !tokens[i].first; }

    const Source& source;
    std::vector<Token> tokens;
};

/// What a parser takes, but nobody means: forgotten quotes that swallow lines, blanks that are
/// none. At most one finding for each line.
Findings find_traps(const Scanned& text);
/// Why a parser may have refused the text, at the places where it was done: a parser stops where it
/// can go on no longer, often lines below. Nothing when nobody knows.
Findings find_causes(const Scanned& text);

/// The indentation of its line cannot be counted in columns.
bool is_oddly_indented(const Scanned& text, const Token& first);

/// `127.0.0.1: 502`, whose first part is `word`: what is wrong with it, and what would be right.
/// Empty when it is no address.
std::string address_hint(std::string_view word, std::string_view all);

/// `*name` takes nothing beside it: how it and the keys `more` are written.
std::string alias_and_more(std::string_view alias, std::string_view more);

/// `bytes`, which differ from the text in no offset, with blanks for the tabs of lines that hold
/// nothing, or a comment alone: those indent nothing.
std::string without_idle_tabs(const Scanned& text, std::string bytes);

// One kind of mistake each, in the order of the text.
void find_patches(const Scanned& text, Findings& findings);
void find_open_quotes(const Scanned& text, Findings& findings);
void find_odd_blanks(const Scanned& text, Findings& findings);
void find_odd_dashes(const Scanned& text, Findings& findings);
void find_typeset_quotes(const Scanned& text, Findings& findings);
void find_quote_ends(const Scanned& text, Findings& findings);
void find_placeholders(const Scanned& text, Findings& findings);
void find_brackets(const Scanned& text, Findings& findings);
void find_directives(const Scanned& text, Findings& findings);
void find_odd_starts(const Scanned& text, Findings& findings);
void find_columns(const Scanned& text, Findings& findings);

}  // namespace panelgate::yaml
