#include "listen_in_text.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <vector>

#include "panelgate/base/utf8.hpp"

namespace panelgate::app {
namespace {

constexpr std::string_view kHttp = "http:";
constexpr std::string_view kListen = "listen:";
constexpr std::string_view kBlank = " \t";

bool is_one_of(std::string_view set, char c) { return set.find(c) != std::string_view::npos; }

std::string_view trimmed(std::string_view text) {
    return text.substr(std::min(text.find_first_not_of(kBlank), text.size()));
}

std::string_view without_comment(std::string_view line) {
    if (trimmed(line).starts_with('#')) return {};
    return line.substr(0, line.find(" #"));
}

std::vector<std::string_view> lines_of(std::string_view text) {
    std::vector<std::string_view> lines;
    while (!text.empty()) {
        const std::size_t end = text.find_first_of("\r\n");
        lines.push_back(without_comment(text.substr(0, end)));
        text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    }
    return lines;
}

/// What stands behind a key, without quotes.
std::string value_in(std::string_view text) {
    text = trimmed(text);
    const bool quoted = text.starts_with('"') || text.starts_with('\'');
    const std::string_view ends = quoted ? text.substr(0, 1) : std::string_view(" \t,}");
    if (quoted) text.remove_prefix(1);
    return std::string(text.substr(0, text.find_first_of(ends)));
}

/// `listen:` directly inside the outermost braces of a line.
std::optional<std::string> in_braces(std::string_view line) {
    int depth = 0;
    for (std::size_t at = 0; at < line.size(); ++at) {
        if (is_one_of("{[", line[at])) ++depth;
        if (is_one_of("}]", line[at])) --depth;
        const bool begins = at > 0 && is_one_of(" \t{,", line[at - 1]);
        if (depth == 1 && begins && line.substr(at).starts_with(kListen))
            return value_in(line.substr(at + kListen.size()));
    }
    return std::nullopt;
}

/// `listen:` as far to the right as the first key of the block.
std::optional<std::string> in_block(const std::vector<std::string_view>& lines, std::size_t first) {
    std::optional<std::size_t> indent;
    for (std::size_t i = first; i < lines.size(); ++i) {
        const std::string_view key = trimmed(lines[i]);
        if (key.empty()) continue;
        const std::size_t here = lines[i].size() - key.size();
        if (here == 0) break;
        if (!indent) indent = here;
        if (here == *indent && key.starts_with(kListen))
            return value_in(key.substr(kListen.size()));
    }
    return std::nullopt;
}

}  // namespace

std::string http_listen_in(std::string_view text) {
    text.remove_prefix(byte_order_mark(text));
    const std::vector<std::string_view> lines = lines_of(text);
    std::set<std::string> found;
    for (std::size_t i = 0; i < lines.size(); ++i) {
        if (!lines[i].starts_with(kHttp)) continue;
        const std::string_view rest = trimmed(lines[i].substr(kHttp.size()));
        found.insert((rest.empty() ? in_block(lines, i + 1) : in_braces(rest)).value_or(""));
    }
    return found.size() == 1 ? *found.begin() : "";
}

}  // namespace panelgate::app
