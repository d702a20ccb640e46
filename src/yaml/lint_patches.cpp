#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "lint.hpp"

namespace panelgate::yaml {
namespace {

using Kind = Token::Kind;

bool stands_left(const Scanned& text, const Token& token) {
    return token.first && token.begin == line_begin(text.source.text(), token.begin);
}

std::string_view line_of(const Scanned& text, const Token& token) {
    const std::string_view rest = text.source.text().substr(token.begin);
    return rest.substr(0, rest.find('\n'));
}

/// A key at the left margin: then the file is whole, and no context of a diff.
bool is_ordinary(const Scanned& text, const Token& token) {
    const char c = text.text(token).front();
    return token.kind == Kind::plain && ((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'));
}

bool is_added(const Scanned& text, const Token& token) {
    return token.kind == Kind::plain && text.text(token).starts_with('+');
}

bool is_heading(std::string_view line) {
    static constexpr std::array<std::string_view, 5> kHeadings{"--- a/", "+++ ", "@@ ",
                                                               "diff --git ", "index "};
    return std::ranges::any_of(kHeadings, [line](auto begin) { return line.starts_with(begin); });
}

/// What one line of a diff says; nothing of its context.
std::string diff_line(const Scanned& text, const Token& token, bool is_whole) {
    if (is_heading(line_of(text, token))) return "this line is the head of a diff; remove it";
    if (is_added(text, token))
        return std::string("the '+' of a diff; ") +
               (is_whole ? "remove it" : "type a blank in its place");
    if (!is_whole && line_of(text, token).starts_with("-  "))
        return "the '-' of a diff: it takes this line away; remove the line";
    return "";
}

void find_diff(const Scanned& text, Findings& findings) {
    bool is_diff = false;
    bool is_whole = false;
    for (const Token& token : text.tokens) {
        if (!stands_left(text, token)) continue;
        const bool heading = is_heading(line_of(text, token));
        is_diff = is_diff || is_added(text, token);
        is_whole = is_whole || (!heading && is_ordinary(text, token));
    }
    if (!is_diff) return;
    for (const Token& token : text.tokens) {
        if (!stands_left(text, token)) continue;
        if (std::string message = diff_line(text, token, is_whole); !message.empty())
            findings.push_back({token.begin, std::move(message)});
    }
}

void find_conflicts(const Scanned& text, Findings& findings) {
    for (const Token& token : text.tokens) {
        if (token.kind != Kind::plain || !stands_left(text, token)) continue;
        const std::string_view line = text.text(token);
        if (line.starts_with("<<<<<<<")) {
            findings.push_back({token.begin,
                                "a merge left two versions here: keep one, and remove the lines "
                                "that begin with <<<<<<<, ======= and >>>>>>>"});
        } else if (line.starts_with("=======") || line.starts_with(">>>>>>>") ||
                   line.starts_with("|||||||")) {
            findings.push_back({token.begin, "a merge left this line; remove it"});
        }
    }
}

}  // namespace

void find_patches(const Scanned& text, Findings& findings) {
    find_conflicts(text, findings);
    find_diff(text, findings);
}

}  // namespace panelgate::yaml
