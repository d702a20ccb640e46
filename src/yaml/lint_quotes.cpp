#include <algorithm>
#include <string>
#include <string_view>

#include "lint.hpp"
#include "panelgate/yaml/quote.hpp"

namespace panelgate::yaml {
namespace {

using Kind = Token::Kind;

constexpr std::size_t kLongest = 60;  ///< of a text that is shown whole

/// The text as it should stand; `inside` the quotes.
std::string closed(char mark, std::string_view inside) {
    if (inside.empty() || inside.size() > kLongest) return std::string("a ") + mark + " is missing";
    return "write " + std::string(1, mark) + std::string(inside) + mark;
}

/// 3/4" and 6' are lengths; of a word, the quote is the end of a text.
bool is_length(std::string_view word) {
    word = word.substr(word.find_last_of(' ') + 1);
    return word.find_first_not_of("0123456789.,/") == word.size() - 1;
}

/// `lines": []`: where a quote stands in a text that has none at its begin. An apostrophe may end
/// a text of several words.
std::size_t lone_quote(std::string_view word) {
    for (const char mark : {'"', '\''}) {
        if (std::ranges::count(word, mark) % 2 == 0) continue;
        const std::size_t at = word.find(mark);
        const bool is_apostrophe =
            mark == '\'' && word.find(' ') != word.npos && word.ends_with("s'");
        const bool is_end = word.ends_with(mark) && !is_apostrophe && !is_length(word);
        if (is_end || word.substr(at + 1).starts_with(':')) return at;
    }
    return word.npos;
}

void find_unopened(const Scanned& text, const Token& token, Findings& findings) {
    const std::string_view word = text.text(token);
    const std::size_t end = lone_quote(word);
    if (end == word.npos) return;
    const std::string mark(1, word[end]);
    findings.push_back({token.begin, "the quote " + mark + " behind " + quote(word.substr(0, end)) +
                                         " is not opened; " +
                                         closed(word[end], word.substr(0, end))});
}

/// What may stand behind a backslash (YAML 1.2, 5.7).
constexpr std::string_view kEscapes = "0abt\tnvfre \"/\\N_LPxuU\n\r";

void find_escapes(const Scanned& text, const Token& token, Findings& findings) {
    const std::string_view word = text.text(token);
    if (word.front() != '"') return;
    for (std::size_t at = word.find('\\'); at < word.size() - 1; at = word.find('\\', at + 2)) {
        if (kEscapes.find(word[at + 1]) != std::string_view::npos) continue;
        findings.push_back({token.begin + at, quote(word.substr(at, 2)) +
                                                  " means nothing in double quotes; write \\\\ for "
                                                  "a backslash, or use single quotes"});
        return;
    }
}

/// 'it's': the text ends where nobody meant it.
void find_behind(const Scanned& text, std::size_t i, Findings& findings) {
    if (!text.follows(i + 1)) return;
    const Token& next = text.tokens[i + 1];
    if (next.kind != Kind::plain && next.kind != Kind::quoted && next.kind != Kind::odd) return;
    const char mark = text.text(text.tokens[i]).front();
    std::string inside = mark == '\'' ? "a ' inside single quotes is written ''"
                                      : "a \" inside double quotes is written \\\"";
    findings.push_back({next.begin, quote(text.text(next)) +
                                        " stands behind the closing quote; remove it, or put all "
                                        "of the text in quotes (" +
                                        inside + ')'});
}

}  // namespace

void find_open_quotes(const Scanned& text, Findings& findings) {
    for (std::size_t i = 0; i < text.tokens.size(); ++i) {
        const Token& token = text.tokens[i];
        const bool is_behind = i > 0 && text.tokens[i - 1].kind == Kind::quoted && !token.first;
        if (token.kind == Kind::plain && !is_behind) find_unopened(text, token, findings);
        if (token.kind != Kind::quoted || token.state != Token::State::unclosed) continue;
        const std::string_view word = text.text(token);
        findings.push_back({token.begin, "the quote " + std::string(1, word.front()) +
                                             " opened here is not closed; " +
                                             closed(word.front(), word.substr(1))});
    }
}

void find_quote_ends(const Scanned& text, Findings& findings) {
    for (std::size_t i = 0; i < text.tokens.size(); ++i) {
        const Token& token = text.tokens[i];
        if (token.kind != Kind::quoted || token.state != Token::State::fine) continue;
        find_escapes(text, token, findings);
        find_behind(text, i, findings);
    }
}

}  // namespace panelgate::yaml
