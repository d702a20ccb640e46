#include <algorithm>
#include <cstddef>
#include <iterator>
#include <string>
#include <string_view>

#include "encoding.hpp"
#include "lint.hpp"

namespace panelgate::yaml {
namespace {

/// Looks like a blank, or like nothing at all, and is none for YAML.
bool is_odd_blank(char32_t c) {
    return c == 0xA0 || c == 0x3000 || c == 0xFEFF || c == 0x202F || (c >= 0x2000 && c <= 0x200B);
}

/// Has no width at all: where it came from, nobody knows.
bool is_unseen(char32_t c) {
    return c == 0x200B || c == 0x200E || c == 0x200F || c == 0x2060 || c == 0xFEFF ||
           (c >= 0x202A && c <= 0x202E) || (c >= 0x2066 && c <= 0x2069);
}

std::size_t find_unseen(std::string_view word) {
    for (std::size_t at = 0; at < word.size();) {
        const std::string_view character = character_at(word, at);
        if (is_unseen(code_point(character))) return at;
        at += character.size();
    }
    return word.npos;
}

std::string odd_blank(char32_t c, std::string_view where) {
    const bool is_no_break = c == 0xA0;
    if (is_unseen(c) && !where.starts_with("behind '"))
        return name_of(c) + " (which nobody sees) stands " + std::string(where) + "; remove it";
    return name_of(c) + (is_no_break ? " (a no-break space)" : " (an odd blank)") + " stands " +
           std::string(where) + "; type an ordinary blank in its place";
}

/// The first odd blank where a blank has a meaning: at the ends of a word, or, unless the word is a
/// value, behind its first colon or dash. Inside a text it is a character like any other.
std::size_t find_odd(std::string_view word, bool is_value) {
    bool meaning = true;
    std::size_t ending = word.npos;
    for (std::size_t at = 0; at < word.size();) {
        const std::string_view character = character_at(word, at);
        const bool odd = is_odd_blank(code_point(character));
        if (odd && meaning) return at;
        if (!odd) ending = word.npos;
        if (odd && ending == word.npos) ending = at;
        meaning = !is_value && (character == ":" || (character == "-" && at == 0));
        at += character.size();
    }
    return ending;
}

/// Behind a real colon another one is part of the text.
bool is_value(const Scanned& text, std::size_t token) {
    return token > 0 && text.tokens[token - 1].kind == Token::Kind::colon && text.follows(token);
}

std::size_t tab_before(const Scanned& text, const Token& first) {
    const std::size_t begin = line_begin(text.source.text(), first.begin);
    const std::size_t tab = text.source.text().substr(begin, first.begin - begin).find('\t');
    return tab == std::string_view::npos ? tab : begin + tab;
}

void find_tab(const Scanned& text, const Token& token, Findings& findings) {
    const std::size_t tab = tab_before(text, token);
    if (tab == std::string_view::npos) return;
    findings.push_back({tab, "a tab in the indentation; type blanks in its place"});
}

/// Between a dash and a key a tab is no indentation.
void find_tab_behind(const Scanned& text, std::size_t dash, Findings& findings) {
    const std::size_t end = text.tokens[dash].end;
    const bool has_key = text.follows(dash + 1) && text.follows(dash + 2) &&
                         text.tokens[dash + 2].kind == Token::Kind::colon;
    if (has_key && text.source.text().substr(end).starts_with('\t'))
        findings.push_back({end, "a tab behind '-'; type a blank in its place"});
}

/// Inside quotes, or of a block of lines.
bool is_text(const Scanned& text, std::size_t offset) {
    const auto behind = std::ranges::upper_bound(text.tokens, offset, {}, &Token::begin);
    return behind != text.tokens.begin() && std::prev(behind)->end > offset;
}

/// `at` in `word`, the first token of its line or not.
std::string_view place_of(std::string_view word, std::size_t at, bool first) {
    if (at == 0) return first ? "in the indentation" : "before this text";
    if (word[at - 1] == ':') return "behind ':'";
    if (word[at - 1] == '-' && at == 1) return "behind '-'";
    return at + character_at(word, at).size() < word.size() ? "in this text" : "behind this text";
}

}  // namespace

bool is_oddly_indented(const Scanned& text, const Token& first) {
    const std::string_view word = text.text(first);
    return tab_before(text, first) != std::string_view::npos ||
           is_odd_blank(code_point(character_at(word, 0)));
}

std::string without_idle_tabs(const Scanned& text, std::string bytes) {
    for (std::size_t begin = 0; begin < bytes.size();) {
        const std::size_t content = std::min(bytes.find_first_not_of(" \t", begin), bytes.size());
        const bool idle = content == bytes.size() || bytes[content] == '#' ||
                          bytes[content] == '\n' || bytes[content] == '\r';
        if (idle && !is_text(text, begin))
            std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(begin),
                      bytes.begin() + static_cast<std::ptrdiff_t>(content), ' ');
        begin = std::min(bytes.find('\n', content), bytes.size() - 1) + 1;
    }
    return bytes;
}

void find_odd_blanks(const Scanned& text, Findings& findings) {
    for (std::size_t i = 0; i < text.tokens.size(); ++i) {
        const Token& token = text.tokens[i];
        if (token.first && token.depth == 0) find_tab(text, token, findings);
        if (token.kind == Token::Kind::dash) find_tab_behind(text, i, findings);
        if (token.kind != Token::Kind::plain) continue;
        const std::string_view word = text.text(token);
        std::size_t at = find_odd(word, is_value(text, i));
        if (at == word.npos) at = find_unseen(word);
        if (at == word.npos) continue;
        const std::string_view where = place_of(word, at, token.first);
        findings.push_back(
            {token.begin + at, odd_blank(code_point(character_at(word, at)), where)});
    }
}

}  // namespace panelgate::yaml
