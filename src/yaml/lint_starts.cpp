#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <string_view>

#include "encoding.hpp"
#include "lint.hpp"
#include "panelgate/yaml/quote.hpp"

namespace panelgate::yaml {
namespace {

using Kind = Token::Kind;

bool is_port(std::string_view text) {
    return text.size() > 1 && text[0] == ':' &&
           text.find_first_not_of("0123456789", 1) == std::string_view::npos;
}

void find_alias(const Token& token, std::string_view name, const std::set<std::string_view>& known,
                Findings& findings) {
    if (known.contains(name)) return;
    if (is_port(name)) {
        findings.push_back({token.begin, "'*' is no address; write 0.0.0.0" + std::string(name) +
                                             " for all addresses of this machine"});
    } else if (name.empty()) {
        findings.push_back(
            {token.begin, "a text that begins with '*' must stand in quotes; write \"*\""});
    } else {
        const std::string text = '*' + std::string(name);
        findings.push_back({token.begin, quote(text) + " repeats what '&" +
                                             std::string(clip(name, 60)) +
                                             "' names, and no such name stands before it; a text "
                                             "that begins with '*' must stand in quotes"});
    }
}

/// Of the line behind the token's begin, what a message shows: lines may be long, and many tokens
/// stand on one.
std::string_view near(const Scanned& text, const Token& token) {
    constexpr std::size_t kShown = 100;
    const std::string_view all = text.source.text().substr(token.begin, kShown);
    return all.substr(0, all.find_first_of("\r\n"));
}

/// `*a {parity: none}`
void find_map_behind(const Scanned& text, std::size_t alias, Findings& findings) {
    if (!text.follows(alias + 1) || text.text(text.tokens[alias + 1]) != "{") return;
    std::string_view more = near(text, text.tokens[alias + 1]).substr(1);
    more = more.substr(0, more.find('}'));
    findings.push_back(
        {text.tokens[alias].begin, alias_and_more(text.text(text.tokens[alias]), more)});
}

/// `(id: 5, name: press)`
void find_round(const Scanned& text, std::size_t i, Findings& findings) {
    const Token& token = text.tokens[i];
    const std::string_view rest = near(text, token);
    const bool is_map = text.follows(i + 1) && text.tokens[i + 1].kind == Kind::colon;
    if (token.kind != Kind::plain || token.depth > 0 || !is_map || rest.front() != '(') return;
    const std::string_view inside = rest.substr(1, rest.find(')') - 1);
    findings.push_back(
        {token.begin, "'(' begins no map; write {" + std::string(clip(inside, 60)) + '}'});
}

void find_odd(const Scanned& text, std::size_t i, Findings& findings) {
    const Token& token = text.tokens[i];
    const std::string_view word = text.text(token);
    if (word == ",") {
        findings.push_back({token.begin, "a ',' separates nothing here; remove it"});
        return;
    }
    findings.push_back({token.begin, "a text that begins with '" + std::string(1, word.front()) +
                                         "' must stand in quotes; write \"" +
                                         std::string(clip(word, 60)) + '"'});
}

/// What surrounds a file on a page or on a screen: a prompt, a fence, a comment of JSON.
bool find_copied(const Token& token, std::string_view word, Findings& findings) {
    const auto begins = [word](std::string_view with) { return word.starts_with(with); };
    if (token.kind == Kind::anchor && begins("&nbsp;")) {
        findings.push_back({token.begin, "'&nbsp;' is a blank of a web page; type blanks"});
    } else if (word == "?" && token.kind == Kind::plain) {
        findings.push_back({token.begin, "a '?' is no value; write what is meant"});
    } else if (!token.first) {
        return false;
    } else if (token.kind == Kind::tag && begins("!include")) {
        findings.push_back({token.begin,
                            "'!include' has no meaning here: the configuration is one file; put "
                            "what the other one holds in place of this line"});
    } else if (begins("//") || begins("/*") || begins("-- ") || begins("<!--")) {
        findings.push_back({token.begin, "a comment begins with '#'"});
    } else if (begins("```") || begins("$ ") || begins("cat >") || begins("cat <") ||
               begins("sudo ") || word == "EOF") {
        findings.push_back({token.begin, "this line is no part of the file; remove it"});
    } else if ((word == "..." || word == "\u2026") && token.kind == Kind::plain) {
        findings.push_back({token.begin, quote(word) +
                                             " stands for something that was left out; write what "
                                             "is meant, or remove the line"});
    } else {
        return false;
    }
    return true;
}

/// As people call it.
std::string sign_of(std::string_view sign) {
    return sign == "*" ? "'*'" : name_of(code_point(sign));
}

/// Quotes as a word processor types them.
bool is_typeset_quote(std::string_view character) {
    static constexpr std::array<std::string_view, 8> kQuotes{
        "\u201C", "\u201D", "\u201E", "\u2018", "\u2019", "\u201A", "\u00AB", "\u00BB"};
    return std::ranges::find(kQuotes, character) != kQuotes.end();
}

}  // namespace

std::string alias_and_more(std::string_view alias, std::string_view more) {
    return "no key may stand beside or below " + quote(alias) +
           "; write {<<: " + std::string(clip(alias, 40)) + ", " + std::string(clip(more, 60)) +
           '}';
}

void find_typeset_quotes(const Scanned& text, Findings& findings) {
    for (const Token& token : text.tokens) {
        if (token.kind != Kind::plain) continue;
        const std::string_view word = text.text(token);
        const std::string_view first = character_at(word, 0);
        std::size_t last = word.size() - 1;
        while (last > 0 && (static_cast<unsigned char>(word[last]) & 0xC0) == 0x80) --last;
        if (last < first.size() || !is_typeset_quote(first) || !is_typeset_quote(word.substr(last)))
            continue;
        const std::string inside(clip(word.substr(first.size(), last - first.size()), 60));
        findings.push_back({token.begin, name_of(code_point(first)) +
                                             " is no quote of YAML; write \"" + inside + '"'});
    }
}

void find_odd_dashes(const Scanned& text, Findings& findings) {
    for (const Token& token : text.tokens) {
        if (token.kind != Kind::dash || token.state != Token::State::stray) continue;
        findings.push_back(
            {token.begin, sign_of(text.text(token)) +
                              " begins no item; type a '-' of the keyboard in its place"});
    }
}

void find_directives(const Scanned& text, Findings& findings) {
    if (text.tokens.empty() || text.tokens.front().kind == Kind::document) return;
    const std::string_view head = text.source.text().substr(0, text.tokens.front().begin);
    const std::size_t sign = head.starts_with('%') ? 0 : head.find("\n%");
    if (sign == head.npos) return;
    findings.push_back({sign + (sign == 0 ? 0 : 1),
                        "a '---' is missing below this directive; write it, or remove this line"});
}

void find_odd_starts(const Scanned& text, Findings& findings) {
    std::set<std::string_view> anchors;
    for (std::size_t i = 0; i < text.tokens.size(); ++i) {
        const Token& token = text.tokens[i];
        const std::string_view word = text.text(token);
        if (find_copied(token, word, findings)) continue;
        if (token.kind == Kind::anchor) anchors.insert(word.substr(1));
        if (token.kind == Kind::alias) {
            find_alias(token, word.substr(1), anchors, findings);
            find_map_behind(text, i, findings);
        }
        if (token.kind == Kind::odd) find_odd(text, i, findings);
        find_round(text, i, findings);
    }
}

}  // namespace panelgate::yaml
