#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "encoding.hpp"
#include "hints.hpp"
#include "lint.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

namespace {

using Kind = Token::Kind;
using State = Token::State;

std::string in_quotes(std::string_view text) { return '"' + std::string(text) + '"'; }

/// [::1]:502 without quotes is a list followed by text.
void find_address(const Scanned& text, std::size_t close, std::size_t open, Findings& findings) {
    if (!text.follows(close + 1)) return;
    const Token& next = text.tokens[close + 1];
    const Token& first = text.tokens[open];
    const std::string_view word = text.text(next);
    if (next.kind == Kind::plain && word.starts_with(':') && next.begin == text.tokens[close].end) {
        const auto all = text.source.text().substr(first.begin, next.end - first.begin);
        findings.push_back(
            {first.begin, "an address in [ ] must be in quotes; write " + in_quotes(all)});
    } else if (next.depth == 0 && next.kind != Kind::colon && next.state != State::stray) {
        findings.push_back({next.begin, quote(word) + " is after the closing " +
                                            std::string(text.text(text.tokens[close])) +
                                            "; remove it, or put it on a line of its own"});
    }
}

/// Returns where an unclosed `${` follows the bracket on its line.
std::size_t open_variable(const Scanned& text, const Token& bracket) {
    constexpr std::size_t kNear = 1'000;  // one line may have many brackets
    std::string_view line = text.source.text().substr(bracket.begin, kNear);
    line = line.substr(0, line.find('\n'));
    const std::size_t dollar = line.find("${");
    if (dollar == line.npos) return dollar;
    const std::size_t end = line.find_first_not_of(
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_0123456789", dollar + 2);
    const bool closed =
        end != line.npos && (line[end] == '}' || line.substr(end).starts_with(":-"));
    return closed ? line.npos : bracket.begin + dollar;
}

/// Returns the offset of a '#' on a line of the bracket that hides its closing bracket.
std::size_t hiding_comment(const Scanned& text, std::size_t open) {
    const char end = text.text(text.tokens[open]) == "[" ? ']' : '}';
    constexpr std::size_t kFar = 200;  // tokens
    const std::size_t last = std::min(open + kFar, text.tokens.size());
    for (std::size_t i = open; i < last; ++i) {
        if (i > open && text.tokens[i].depth <= text.tokens[open].depth) break;
        if (text.follows(i + 1)) continue;
        const std::size_t from = text.tokens[i].end;
        std::string_view rest = text.source.text().substr(from);
        rest = rest.substr(0, rest.find('\n'));
        const std::size_t sign = rest.find('#');
        if (sign != rest.npos && rest.find(end, sign) != rest.npos) return from + sign;
    }
    return std::string_view::npos;
}

/// {id: 5, name: press]: returns the closing bracket of the wrong kind.
const Token* wrong_close(const Scanned& text, std::size_t open) {
    constexpr std::size_t kFar = 200;  // tokens
    for (std::size_t i = open + 1; i < open + kFar && text.follows(i); ++i) {
        const Token& token = text.tokens[i];
        if (token.kind == Kind::close && token.state == State::stray) return &token;
        if (token.depth <= text.tokens[open].depth) break;
    }
    return nullptr;
}

void find_unclosed(const Scanned& text, std::size_t i, Findings& findings) {
    const Token& token = text.tokens[i];
    const std::size_t comment =
        token.state == State::unclosed ? hiding_comment(text, i) : std::string_view::npos;
    if (comment != std::string_view::npos) {
        const std::string end = text.text(token) == "[" ? "']'" : "'}'";
        findings.push_back(
            {comment,
             "this '#' begins a comment, which hides the " + end +
                 " after it; put a text that begins with '#' in quotes, or a comment after the " +
                 end});
        return;
    }
    const std::size_t dollar =
        token.state == State::unclosed ? open_variable(text, token) : std::string_view::npos;
    if (dollar != std::string_view::npos) {
        findings.push_back({dollar, "a variable is written ${NAME}; a '}' is missing"});
        return;
    }
    const bool list = text.text(token) == "[";
    const Token* wrong = token.state == State::unclosed ? wrong_close(text, i) : nullptr;
    if (wrong != nullptr) {
        findings.push_back({wrong->begin, '\'' + std::string(text.text(*wrong)) +
                                              "' closes nothing; the " + (list ? "'['" : "'{'") +
                                              " before it ends with '" + (list ? ']' : '}') +
                                              "': type that in its place"});
    } else if (token.state == State::unclosed) {
        findings.push_back({token.begin, std::string(list ? "'['" : "'{'") +
                                             " is never closed; a '" + (list ? ']' : '}') +
                                             "' is missing after it"});
    }
    if (token.state == State::stray) {
        const bool closes_list = text.text(token) == "]";
        findings.push_back({token.begin, std::string(closes_list ? "']'" : "'}'") +
                                             " closes nothing; remove it, or open it with '" +
                                             (closes_list ? '[' : '{') + '\''});
    }
}

/// Detects {a: 1 b: 2}: two colons without a comma between them.
struct Pair {
    std::size_t open = 0;  ///< token
    bool colon = false;    ///< since the last comma
};

/// The key is on a line of its own: the value before it lacks a comma.
bool find_comma_of_line(const Scanned& text, const Token& key, const Token& value,
                        Findings& findings) {
    const bool ends =
        value.kind == Kind::plain || value.kind == Kind::quoted || value.kind == Kind::close;
    if (!key.first || !ends) return false;
    findings.push_back(
        {value.end, "a ',' is missing after " + (value.kind == Kind::close
                                                     ? '\'' + std::string(text.text(value)) + '\''
                                                     : quote(text.text(value)))});
    return true;
}

void find_comma(const Scanned& text, std::size_t colon, Findings& findings) {
    const Token& before = text.tokens[colon - 1];
    if (colon > 1 && find_comma_of_line(text, before, text.tokens[colon - 2], findings)) return;
    const std::string_view word = text.text(before);
    const std::size_t blank = word.find_last_of(" \t");
    if (before.kind == Kind::plain && blank == word.npos) {
        const std::size_t last = text.follows(colon + 1) ? colon + 1 : colon;
        const std::size_t end = text.tokens[last].end;
        const auto all = clip(text.source.text().substr(before.begin, end - before.begin), 60);
        const std::string address = address_hint(word, all);
        findings.push_back({before.begin, !address.empty()
                                              ? address
                                              : "a text that holds ': ' must be in quotes; write " +
                                                    in_quotes(all)});
        return;
    }
    const std::size_t key = before.kind == Kind::plain ? blank + 1 : 0;
    findings.push_back({before.begin + key, "a ',' is missing before " + quote(word.substr(key))});
}

/// True for {{ name }}, a placeholder of other programs.
bool is_placeholder(const Scanned& text, const Token& token) {
    return token.kind == Kind::open && text.source.text().substr(token.begin).starts_with("{{");
}

}  // namespace

void find_placeholders(const Scanned& text, Findings& findings) {
    for (const Token& token : text.tokens) {
        if (!is_placeholder(text, token)) continue;
        constexpr std::size_t kLongest = 60;
        std::string_view name = text.source.text().substr(token.begin + 2, kLongest);
        name = name.substr(0, name.find_first_of("}\n"));
        while (name.starts_with(' ')) name.remove_prefix(1);
        while (name.ends_with(' ')) name.remove_suffix(1);
        const bool word = is_word(name) && name.find('-') == name.npos;
        findings.push_back({token.begin, "'{{' means nothing here; a variable is written ${" +
                                             std::string(word ? name : "NAME") + '}'});
    }
}

std::string address_hint(std::string_view word, std::string_view all) {
    const std::size_t port = all.find_first_not_of(" \t", std::min(word.size() + 1, all.size()));
    const bool is_host = word.find_first_of(".:]") != word.npos || word == "localhost";
    if (!is_host || port == all.npos || word.find_first_of(" \t") != word.npos ||
        all.find_first_not_of("0123456789/", port) != all.npos)
        return "";
    return "a blank after the ':' of an address; write " + std::string(word) + ':' +
           std::string(all.substr(port));
}

void find_brackets(const Scanned& text, Findings& findings) {
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < text.tokens.size(); ++i) {
        const Token& token = text.tokens[i];
        while (pairs.size() > token.depth) pairs.pop_back();
        if (token.kind == Kind::open) {
            if (!is_placeholder(text, token)) find_unclosed(text, i, findings);
            pairs.push_back({i, false});
        } else if (token.kind == Kind::close) {
            find_unclosed(text, i, findings);
            if (token.state == State::fine && pairs.size() == 1)
                find_address(text, i, pairs.back().open, findings);
        } else if (!pairs.empty() && token.kind == Kind::comma) {
            pairs.back().colon = false;
        } else if (!pairs.empty() && token.kind == Kind::colon) {
            if (pairs.back().colon) find_comma(text, i, findings);
            pairs.back().colon = true;
        }
    }
}

}  // namespace panelgate::yaml
