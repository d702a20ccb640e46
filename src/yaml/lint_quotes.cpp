#include <string>
#include <string_view>

#include "lint.hpp"
#include "panelgate/yaml/quote.hpp"

namespace panelgate::yaml {
namespace {

using Kind = Token::Kind;

/// The text as it should stand, closed where the person most likely meant it.
std::string closed(const Scanned& text, const Token& token) {
    std::string_view inside = text.text(token);
    const char mark = inside.front();
    if (token.depth > 0) inside = inside.substr(0, inside.find_first_of(",]}"));
    inside = inside.substr(0, inside.find(" #"));
    const std::size_t last = inside.find_last_not_of(" \t\r");
    inside = inside.substr(1, last == 0 ? 0 : last);
    constexpr std::size_t kMost = 60;
    if (inside.empty() || inside.size() > kMost) return std::string("a ") + mark + " is missing";
    return "write " + std::string(1, mark) + std::string(inside) + mark;
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
    for (const Token& token : text.tokens) {
        if (token.kind != Kind::quoted || token.state != Token::State::unclosed) continue;
        const std::string mark(1, text.text(token).front());
        findings.push_back({token.begin, "the quote " + mark + " opened here is not closed; " +
                                             closed(text, token)});
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
