#include "mbusd_lines.hpp"

#include <algorithm>

#include "panelgate/base/utf8.hpp"
#include "panelgate/yaml/quote.hpp"

namespace panelgate::config {
namespace {

constexpr std::string_view kBlanks = " \t\f\v";

std::string_view without_blanks(std::string_view text) {
    const std::size_t first = text.find_first_not_of(kBlanks);
    if (first == text.npos) return {};
    return text.substr(first, text.find_last_not_of(kBlanks) + 1 - first);
}

bool has_control_character(std::string_view text) {
    return std::ranges::any_of(text, [](unsigned char c) { return c < ' ' || c == 0x7f; });
}

void take_line(std::string_view whole, int number, std::vector<MbusdLine>& lines,
               yaml::Problems& problems) {
    const std::string_view typed = without_blanks(whole);
    if (typed.empty() || typed[0] == '#') return;
    const auto column = [&](std::string_view part) {
        return part.empty() ? static_cast<int>(whole.size()) + 1
                            : static_cast<int>(part.data() - whole.data()) + 1;
    };
    const std::size_t sign = typed.find('=');
    const std::string_view name = without_blanks(typed.substr(0, sign));
    const yaml::Mark mark{number, column(typed)};
    if (sign == typed.npos || name.empty()) {
        problems.add(mark,
                     "a line must be NAME = VALUE such as speed = 19200, or a comment that "
                     "begins with '#', not " +
                         yaml::quote(typed));
        return;
    }
    const std::string_view value = without_blanks(typed.substr(sign + 1));
    if (has_control_character(value)) {
        problems.add({number, column(value)},
                     std::string(name) + " must be plain text; it holds control characters");
        return;
    }
    lines.push_back({std::string(name), std::string(value), mark, {number, column(value)}});
}

}  // namespace

std::vector<MbusdLine> mbusd_lines(std::string_view text, yaml::Problems& problems) {
    std::vector<MbusdLine> lines;
    text.remove_prefix(byte_order_mark(text));
    for (int number = 1; !text.empty(); ++number) {
        const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
        take_line(text.substr(0, end), number, lines, problems);
        text.remove_prefix(end);
        text.remove_prefix(text.starts_with("\r\n") ? 2 : text.empty() ? 0 : 1);
    }
    return lines;
}

}  // namespace panelgate::config
