#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <vector>

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

/// The first lines that hold anything, as they are typed.
std::vector<std::string_view> first_lines(std::string_view text) {
    constexpr std::size_t kMost = 20;
    std::vector<std::string_view> lines;
    for (std::size_t at = 0; at < text.size() && lines.size() < kMost;) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        const std::string_view line = text.substr(at, end - at);
        if (line.find_first_not_of(" \t\r") != line.npos) lines.push_back(line);
        at = end + 1;
    }
    return lines;
}

/// 12 of "12   - name: press" and of "12: lines:"; 0 of anything else.
std::size_t line_number(std::string_view line) {
    constexpr std::string_view kDigits = "0123456789";
    line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
    const std::size_t end = std::min(line.find_first_not_of(kDigits), line.size());
    constexpr std::size_t kLongest = 6;
    if (end == 0 || end > kLongest) return 0;
    const bool alone =
        end == line.size() || std::string_view(" \t\r:|").find(line[end]) != line.npos;
    return alone ? std::stoul(std::string(line.substr(0, end))) : 0;
}

/// What a mail, a table or a listing puts before each line.
void find_margins(const Scanned& text, Findings& findings) {
    const std::vector<std::string_view> lines = first_lines(text.source.text());
    if (lines.size() < 2) return;
    const auto offset = [&](char sign) {
        return static_cast<std::size_t>(lines[0].data() - text.source.text().data()) +
               std::min(lines[0].find(sign), lines[0].size());
    };
    for (const char sign : {'>', '|'}) {
        const bool all = std::ranges::all_of(lines, [sign](std::string_view line) {
            return line.substr(line.find_first_not_of(' ')).starts_with(sign);
        });
        if (!all) continue;
        findings.push_back(
            {offset(sign), std::string("the '") + sign +
                               (sign == '>' ? "' of a quoted mail" : "' of a table") +
                               "; remove it from every line"});
        return;
    }
    const std::size_t first = line_number(lines[0]);
    for (std::size_t i = 0; i < lines.size(); ++i)
        if (first == 0 || line_number(lines[i]) < first + i) return;
    findings.push_back({offset(lines[0][lines[0].find_first_not_of(' ')]),
                        "the number of a line in a listing; remove it, and those below, with what "
                        "stands between them and the text"});
}

}  // namespace

void find_patches(const Scanned& text, Findings& findings) {
    find_margins(text, findings);
    find_conflicts(text, findings);
    find_diff(text, findings);
}

}  // namespace panelgate::yaml
