#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "encoding.hpp"
#include "lint.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

namespace {

using Kind = Token::Kind;
using State = Token::State;

std::string quoted(char bracket) { return std::string("'") + bracket + '\''; }

/// Calls `on` for the tokens inside an unclosed bracket, until it returns true.
template <class On>
void each_inside(const Scanned& text, std::size_t open, const On& on) {
    constexpr std::size_t kFar = 200;  // tokens; one line may have many brackets
    const std::size_t last = std::min(open + kFar, text.tokens.size());
    for (std::size_t i = open + 1; i < last; ++i) {
        const Token& token = text.tokens[i];
        if ((token.depth <= text.tokens[open].depth && token.state != State::stray) || on(i)) break;
    }
}

/// A bracket that is open to the end: a '#' hides its other half, or that is of the other kind, or
/// missing.
Finding why_unclosed(const Scanned& text, std::size_t open) {
    const bool list = text.text(open) == "[";
    const char end = list ? ']' : '}';
    const Token& token = text.tokens[open];
    Finding found{token.begin, quoted(list ? '[' : '{') + " is never closed; a " + quoted(end) +
                                   " is missing after it"};
    const auto hides = [&](std::size_t i) {
        if (text.follows(i + 1)) return false;
        std::string_view line = text.source.text().substr(text.tokens[i].end);
        line = line.substr(0, line.find('\n'));
        const std::size_t sign = line.find('#');
        if (sign == line.npos || line.find(end, sign) == line.npos) return false;
        found = {text.tokens[i].end + sign,
                 "this '#' begins a comment, which hides the " + quoted(end) +
                     " after it; put a text that begins with '#' in quotes, or a comment after "
                     "the " +
                     quoted(end)};
        return true;
    };
    const auto is_wrong = [&](std::size_t i) {
        if (text.tokens[i].state != State::stray || !text.follows(i)) return false;
        found = {text.tokens[i].begin, '\'' + std::string(text.text(i)) + "' closes nothing; the " +
                                           quoted(list ? '[' : '{') + " before it ends with " +
                                           quoted(end) + ": type that in its place"};
        return true;
    };
    each_inside(text, open, is_wrong);
    if (found.offset == token.begin && !hides(open)) each_inside(text, open, hides);
    return found;
}

/// {a: 1 b: 2}: the second colon without a comma before it.
Finding why_two_colons(const Scanned& text, std::size_t colon) {
    const Token& key = text.tokens[colon - 1];
    const std::string_view word = text.text(key);
    if (key.first && colon > 1) {  // on a line of its own
        const std::string_view value = text.text(colon - 2);
        return {text.tokens[colon - 2].end,
                "a ',' is missing after " + (value.size() == 1 ? quoted(value[0]) : quote(value))};
    }
    const std::size_t blank = word.find_last_of(" \t");
    if (key.kind == Kind::plain && blank == word.npos) {
        const std::size_t last = text.follows(colon + 1) ? colon + 1 : colon;
        const auto all = text.source.text().substr(key.begin, text.tokens[last].end - key.begin);
        return {key.begin, "a text that holds ': ' must be in quotes; write \"" +
                               std::string(clip(all, 60)) + '"'};
    }
    const std::size_t begin = key.kind == Kind::plain ? blank + 1 : 0;
    return {key.begin + begin, "a ',' is missing before " + quote(word.substr(begin))};
}

}  // namespace

void find_brackets(const Scanned& text, Findings& findings) {
    std::vector<bool> colons;  // of each open bracket: since the last comma
    for (std::size_t i = 0; i < text.tokens.size(); ++i) {
        const Token& token = text.tokens[i];
        if (colons.size() > token.depth) colons.resize(token.depth);
        if (token.state == State::unclosed && token.kind == Kind::open)
            findings.push_back(why_unclosed(text, i));
        if (token.kind == Kind::open) colons.push_back(false);
        if (token.kind == Kind::close && token.state == State::stray) {
            const bool list = text.text(i) == "]";
            findings.push_back({token.begin, quoted(list ? ']' : '}') +
                                                 " closes nothing; remove it, or open it with " +
                                                 quoted(list ? '[' : '{')});
        }
        const bool ends = token.kind == Kind::close && token.depth == 1 && text.follows(i + 1);
        if (ends && text.tokens[i + 1].kind != Kind::colon &&
            text.tokens[i + 1].state != State::stray)
            findings.push_back(
                {text.tokens[i + 1].begin, quote(text.text(i + 1)) + " is after the closing " +
                                               std::string(text.text(i)) +
                                               "; remove it, or put it on a line of its own"});
        if (colons.empty() || (token.kind != Kind::colon && token.kind != Kind::comma)) continue;
        if (token.kind == Kind::colon && colons.back()) findings.push_back(why_two_colons(text, i));
        colons.back() = token.kind == Kind::colon;
    }
}

}  // namespace panelgate::yaml
