#include "listen_in_text.hpp"

#include <algorithm>

namespace panelgate::app {
namespace {

constexpr std::string_view kHttp = "http:";
constexpr std::string_view kListen = "listen:";
constexpr std::string_view kBlank = " \t";

bool is_one_of(std::string_view set, char c) { return set.find(c) != std::string_view::npos; }

std::string_view without_comment(std::string_view line) {
    if (line.starts_with('#')) return {};
    return line.substr(0, line.find(" #"));
}

/// From the value's first character on.
std::string value_in(std::string_view text) {
    const std::size_t begin = std::min(text.find_first_not_of(kBlank), text.size());
    text.remove_prefix(begin);
    const bool quoted = text.starts_with('"') || text.starts_with('\'');
    const std::string_view ends = quoted ? text.substr(0, 1) : std::string_view(" \t,}");
    if (quoted) text.remove_prefix(1);
    return std::string(text.substr(0, text.find_first_of(ends)));
}

/// `listen:` as a key: at the beginning, or behind a blank, '{' or ','.
std::size_t find_listen(std::string_view line) {
    for (std::size_t at = line.find(kListen); at != std::string_view::npos;
         at = line.find(kListen, at + 1)) {
        if (at == 0 || is_one_of(" \t{,", line[at - 1])) return at;
    }
    return std::string_view::npos;
}

}  // namespace

std::string http_listen_in(std::string_view text) {
    bool inside = false;
    while (!text.empty()) {
        const std::size_t end = text.find_first_of("\r\n");
        std::string_view line = without_comment(text.substr(0, end));
        text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
        if (!line.empty() && !is_one_of(kBlank, line.front())) {
            inside = line.starts_with(kHttp);
            if (inside) line.remove_prefix(kHttp.size());
        }
        const std::size_t at = inside ? find_listen(line) : std::string_view::npos;
        if (at != std::string_view::npos) return value_in(line.substr(at + kListen.size()));
    }
    return "";
}

}  // namespace panelgate::app
