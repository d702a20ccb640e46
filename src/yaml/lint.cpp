#include "lint.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>
#include <set>
#include <span>
#include <string>
#include <string_view>

#include "encoding.hpp"
#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/settings.hpp"

namespace panelgate::yaml {

namespace {

using Find = void (*)(const Scanned&, Findings&);

/// Runs `finds` in order of precedence; the first finding on a line is the nearest to its cause.
Findings run(const Scanned& text, std::span<const Find> finds) {
    Findings all;
    std::set<int> lines;
    for (const Find find : finds) {
        Findings some;
        find(text, some);
        std::set<int> told;
        for (Finding& finding : some) {
            const int line = text.source.mark(finding.offset).line;
            if (lines.contains(line) || !told.insert(line).second) continue;
            if (all.size() < kMaxShown) all.push_back(std::move(finding));
        }
        lines.merge(told);
    }
    std::ranges::sort(all, {}, &Finding::offset);
    return all;
}

}  // namespace

std::string_view Scanned::rest(std::size_t token) const {
    std::size_t last = token;
    while (follows(last + 1)) ++last;
    return source.text().substr(tokens[token].begin, tokens[last].end - tokens[token].begin);
}

Findings find_traps(const Scanned& text) {
    static constexpr std::array<Find, 6> kFinds{find_wrong_blanks, find_wrong_dashes,
                                                find_open_quotes,  find_typeset_quotes,
                                                find_directives,   find_placeholders};
    return run(text, kFinds);
}

Findings find_causes(const Scanned& text) {
    static constexpr std::array<Find, 10> kFinds{
        find_wrong_blanks, find_wrong_dashes, find_open_quotes, find_typeset_quotes,
        find_directives,   find_placeholders, find_quote_ends,  find_brackets,
        find_wrong_starts, find_columns};
    return run(text, kFinds);
}

namespace {

/// True for characters that look like a blank, or are invisible, but are no blank to YAML.
bool is_wrong_blank(char32_t c) {
    return c == 0xA0 || c == 0x3000 || c == 0xFEFF || c == 0x202F || (c >= 0x2000 && c <= 0x200B);
}

/// True for characters without width, whose origin users cannot see.
bool is_invisible(char32_t c) {
    return c == 0x200B || c == 0x200E || c == 0x200F || c == 0x2060 || c == 0xFEFF ||
           (c >= 0x202A && c <= 0x202E) || (c >= 0x2066 && c <= 0x2069);
}

std::size_t find_invisible(std::string_view word) {
    for (std::size_t at = 0; at < word.size();) {
        const std::string_view character = character_at(word, at);
        if (is_invisible(code_point(character))) return at;
        at += character.size();
    }
    return word.npos;
}

std::string wrong_blank(char32_t c, std::string_view where) {
    const bool is_no_break = c == 0xA0;
    if (is_invisible(c) && !where.starts_with("after '"))
        return name_of(c) + " (which is invisible) is " + std::string(where) + "; remove it";
    return name_of(c) + (is_no_break ? " (a no-break space)" : " (an unusual blank)") + " is " +
           std::string(where) + "; type an ordinary blank in its place";
}

/// Finds the first such blank where a blank is significant: at the ends of a word, or, unless the
/// word is a value, after its first colon or dash. Inside a text it is an ordinary character.
std::size_t find_wrong(std::string_view word, bool is_value) {
    bool meaning = true;
    std::size_t ending = word.npos;
    for (std::size_t at = 0; at < word.size();) {
        const std::string_view character = character_at(word, at);
        const bool odd = is_wrong_blank(code_point(character));
        if (odd && meaning) return at;
        if (!odd) ending = word.npos;
        if (odd && ending == word.npos) ending = at;
        meaning = !is_value && (character == ":" || (character == "-" && at == 0));
        at += character.size();
    }
    return ending;
}

/// After a real colon another one is part of the text.
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

/// A tab between a dash and a key is no indentation.
void find_tab_after_dash(const Scanned& text, std::size_t dash, Findings& findings) {
    const std::size_t end = text.tokens[dash].end;
    const bool has_key = text.follows(dash + 1) && text.follows(dash + 2) &&
                         text.tokens[dash + 2].kind == Token::Kind::colon;
    if (has_key && text.source.text().substr(end).starts_with('\t'))
        findings.push_back({end, "a tab after '-'; type a blank in its place"});
}

/// True inside quotes or a block of lines.
bool is_text(const Scanned& text, std::size_t offset) {
    const auto behind = std::ranges::upper_bound(text.tokens, offset, {}, &Token::begin);
    return behind != text.tokens.begin() && std::prev(behind)->end > offset;
}

/// Describes the place `at` in `word`, which is the first token of its line or not.
std::string_view place_of(std::string_view word, std::size_t at, bool first) {
    if (at == 0) return first ? "in the indentation" : "before this text";
    if (word[at - 1] == ':') return "after ':'";
    if (word[at - 1] == '-' && at == 1) return "after '-'";
    return at + character_at(word, at).size() < word.size() ? "in this text" : "after this text";
}

}  // namespace

bool has_wrong_indent(const Scanned& text, const Token& first) {
    const std::string_view word = text.text(first);
    return tab_before(text, first) != std::string_view::npos ||
           is_wrong_blank(code_point(character_at(word, 0)));
}

std::string without_blank_tabs(const Scanned& text, std::string bytes) {
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

void find_wrong_blanks(const Scanned& text, Findings& findings) {
    for (std::size_t i = 0; i < text.tokens.size(); ++i) {
        const Token& token = text.tokens[i];
        if (token.first && token.depth == 0) find_tab(text, token, findings);
        if (token.kind == Token::Kind::dash) find_tab_after_dash(text, i, findings);
        if (token.kind != Token::Kind::plain) continue;
        const std::string_view word = text.text(token);
        std::size_t at = find_wrong(word, is_value(text, i));
        if (at == word.npos) at = find_invisible(word);
        if (at == word.npos) continue;
        const std::string_view where = place_of(word, at, token.first);
        findings.push_back(
            {token.begin + at, wrong_blank(code_point(character_at(word, at)), where)});
    }
}

namespace {

using Kind = Token::Kind;

constexpr std::size_t kLongestQuoted = 60;  ///< of a text that is shown whole

/// Suggests the corrected text; `inside` the quotes.
std::string closed(char mark, std::string_view inside) {
    if (inside.empty() || inside.size() > kLongestQuoted)
        return std::string("a ") + mark + " is missing";
    return "write " + std::string(1, mark) + std::string(inside) + mark;
}

/// 3/4" and 6' are lengths; after a word, the quote ends a text.
bool is_length(std::string_view word) {
    word = word.substr(word.find_last_of(' ') + 1);
    return word.find_first_not_of("0123456789.,/") == word.size() - 1;
}

/// Returns where a quote is that closes but was not opened: `lines": []`. An apostrophe may end a
/// text of several words.
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
    findings.push_back({token.begin, "the quote " + mark + " after " + quote(word.substr(0, end)) +
                                         " is not opened; " +
                                         closed(word[end], word.substr(0, end))});
}

/// What may follow a backslash (YAML 1.2, 5.7).
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

/// 'it's': the text ends too early.
void find_text_after_quote(const Scanned& text, std::size_t i, Findings& findings) {
    if (!text.follows(i + 1)) return;
    const Token& next = text.tokens[i + 1];
    if (next.kind != Kind::plain && next.kind != Kind::quoted && next.kind != Kind::odd) return;
    const char mark = text.text(text.tokens[i]).front();
    std::string inside = mark == '\'' ? "a ' inside single quotes is written ''"
                                      : "a \" inside double quotes is written \\\"";
    findings.push_back(
        {next.begin,
         quote(text.text(next)) +
             " is after the closing quote; remove it, or put all of the text in quotes (" + inside +
             ')'});
}

}  // namespace

void find_open_quotes(const Scanned& text, Findings& findings) {
    for (std::size_t i = 0; i < text.tokens.size(); ++i) {
        const Token& token = text.tokens[i];
        const bool is_after_quote =
            i > 0 && text.tokens[i - 1].kind == Kind::quoted && !token.first;
        if (token.kind == Kind::plain && !is_after_quote) find_unopened(text, token, findings);
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
        find_text_after_quote(text, i, findings);
    }
}

namespace {

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
            {token.begin, "a text that begins with '*' must be in quotes; write \"*\""});
    } else {
        const std::string text = '*' + std::string(name);
        findings.push_back({token.begin, quote(text) + " repeats what '&" +
                                             std::string(clip(name, 60)) +
                                             "' names, and there is no such name before it; a text "
                                             "that begins with '*' must be in quotes"});
    }
}

/// Returns what a message shows of the line from the token on: bounded, as long lines may have many
/// tokens.
std::string_view near(const Scanned& text, const Token& token) {
    constexpr std::size_t kShown = 100;
    const std::string_view all = text.source.text().substr(token.begin, kShown);
    return all.substr(0, all.find_first_of("\r\n"));
}

/// `*a {parity: none}`
void find_map_after_alias(const Scanned& text, std::size_t alias, Findings& findings) {
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

void find_wrong(const Scanned& text, std::size_t i, Findings& findings) {
    const Token& token = text.tokens[i];
    const std::string_view word = text.text(token);
    if (word == ",") {
        findings.push_back({token.begin, "a ',' separates nothing here; remove it"});
        return;
    }
    findings.push_back({token.begin, "a text that begins with '" + std::string(1, word.front()) +
                                         "' must be in quotes; write \"" +
                                         std::string(clip(word, 60)) + '"'});
}

/// Reports what means something in other languages: a JSON comment, an include.
bool find_foreign(const Token& token, std::string_view word, Findings& findings) {
    const auto begins = [word](std::string_view with) { return word.starts_with(with); };
    if (word == "?" && token.kind == Kind::plain) {
        findings.push_back({token.begin, "a '?' is no value; write what is meant"});
    } else if (!token.first) {
        return false;
    } else if (token.kind == Kind::tag && begins("!include")) {
        findings.push_back({token.begin,
                            "'!include' has no meaning here: the configuration is one file; put "
                            "what the other one holds in place of this line"});
    } else if (begins("//") || begins("/*") || begins("-- ") || begins("<!--")) {
        findings.push_back({token.begin, "a comment begins with '#'"});
    } else {
        return false;
    }
    return true;
}

/// The name that users know.
std::string sign_of(std::string_view sign) {
    return sign == "*" ? "'*'" : name_of(code_point(sign));
}

/// True for quotes as a word processor types them.
bool is_typeset_quote(std::string_view character) {
    static constexpr std::array<std::string_view, 8> kQuotes{
        "\u201C", "\u201D", "\u201E", "\u2018", "\u2019", "\u201A", "\u00AB", "\u00BB"};
    return std::ranges::find(kQuotes, character) != kQuotes.end();
}

}  // namespace

std::string alias_and_more(std::string_view alias, std::string_view more) {
    return "no key may be beside or below " + quote(alias) +
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

void find_wrong_dashes(const Scanned& text, Findings& findings) {
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

void find_wrong_starts(const Scanned& text, Findings& findings) {
    std::set<std::string_view> anchors;
    for (std::size_t i = 0; i < text.tokens.size(); ++i) {
        const Token& token = text.tokens[i];
        const std::string_view word = text.text(token);
        if (find_foreign(token, word, findings)) continue;
        if (token.kind == Kind::anchor) anchors.insert(word.substr(1));
        if (token.kind == Kind::alias) {
            find_alias(token, word.substr(1), anchors, findings);
            find_map_after_alias(text, i, findings);
        }
        if (token.kind == Kind::odd) find_wrong(text, i, findings);
        find_round(text, i, findings);
    }
}

}  // namespace panelgate::yaml
