#include "table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "panelgate/base/text.hpp"

namespace panelgate::commands {

namespace {

const char* escape_of(Colour colour) {
    switch (colour) {
        case Colour::none:
            return "";
        case Colour::good:
            return "\x1b[32m";
        case Colour::warning:
            return "\x1b[33m";
        case Colour::bad:
            return "\x1b[1;31m";
        case Colour::heading:
            return "\x1b[1m";
    }
    std::abort();
}

std::string with_digits(double value, int digits, const char* unit) {
    char text[64];
    std::snprintf(text, sizeof text, "%.*f %s", digits, value, unit);
    return text;
}

}  // namespace

std::string painted(const std::string& text, Colour colour, bool coloured) {
    if (!coloured || colour == Colour::none || text.empty()) return text;
    return escape_of(colour) + text + "\x1b[0m";
}

bool wants_colours(bool is_terminal, const char* no_color, const char* term) {
    if (!is_terminal || (no_color != nullptr && *no_color != '\0')) return false;
    return term == nullptr || std::string_view(term) != "dumb";
}

std::size_t width_of(std::string_view text) {
    return static_cast<std::size_t>(std::ranges::count_if(
        text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

TextTable::TextTable(std::vector<std::string> headings) {
    for (std::string& heading : headings) {
        const bool right = heading.starts_with('>');
        right_.push_back(right);
        headings_.emplace_back(right ? heading.substr(1) : std::move(heading), Colour::heading);
    }
}

void TextTable::add(std::vector<Cell> row) {
    row.resize(headings_.size(), Cell(""));
    rows_.push_back(std::move(row));
}

std::string TextTable::line(const std::vector<Cell>& row, const std::vector<std::size_t>& widths,
                            bool coloured) const {
    std::string made;
    std::string blanks;  // written only before something
    for (std::size_t i = 0; i < row.size(); ++i) {
        const std::string fill(widths[i] - std::min(widths[i], width_of(row[i].text)), ' ');
        if (right_[i]) blanks += fill;
        if (!row[i].text.empty()) {
            made += blanks + painted(row[i].text, row[i].colour, coloured);
            blanks.clear();
        }
        if (!right_[i]) blanks += fill;
        blanks += "  ";
    }
    return made + '\n';
}

std::string TextTable::text(bool coloured) const {
    std::vector<std::size_t> widths;
    for (const Cell& heading : headings_) widths.push_back(width_of(heading.text));
    for (const auto& row : rows_) {
        for (std::size_t i = 0; i < row.size(); ++i)
            widths[i] = std::max(widths[i], width_of(row[i].text));
    }
    const bool headed =
        std::ranges::any_of(headings_, [](const Cell& heading) { return !heading.text.empty(); });
    std::string made = headed ? line(headings_, widths, coloured) : "";
    for (const auto& row : rows_) made += line(row, widths, coloured);
    return made;
}

namespace {

/// The first `columns` characters of a line, which escape sequences do not use up.
std::string cut_line(std::string_view line, std::size_t columns) {
    std::string made;
    std::size_t used = 0;
    for (std::size_t i = 0; i < line.size(); ++i) {
        if (line[i] == '\x1b') {
            const std::size_t end = std::min(line.find('m', i), line.size() - 1);
            made += line.substr(i, end - i + 1);
            i = end;
            continue;
        }
        const bool begins = (static_cast<unsigned char>(line[i]) & 0xC0U) != 0x80U;
        if (begins) ++used;
        if (used <= columns) made += line[i];
    }
    return made;
}

}  // namespace

std::string cut_to_screen(std::string_view text, std::size_t rows, std::size_t columns) {
    std::vector<std::string> lines;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        lines.push_back(cut_line(text.substr(0, end), columns));
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    if (lines.size() > rows) {
        lines[rows - 2] = "(" + std::to_string(lines.size() - rows + 1) + " more lines)";
        lines[rows - 1] = lines.back();
        lines.resize(rows);
    }
    std::string made;
    for (const std::string& line : lines) made += line + '\n';
    made.resize(made.size() - std::min<std::size_t>(made.size(), 1));
    return made;
}

std::string span_text(double seconds) {
    if (seconds < 10) return with_digits(std::max(seconds, 0.0), 1, "s");
    if (seconds < 100) return with_digits(std::floor(seconds), 0, "s");
    if (seconds < 100 * 60) return with_digits(std::floor(seconds / 60), 0, "min");
    if (seconds < 48 * 3600) return with_digits(std::floor(seconds / 3600), 0, "h");
    return with_digits(std::floor(seconds / 86400), 0, "d");
}

std::string latency_text(double seconds) {
    if (!std::isfinite(seconds) || seconds < 0) return "-";
    if (seconds < 1) return with_digits(seconds * 1000, 1, "ms");
    return with_digits(seconds, 1, "s");
}

}  // namespace panelgate::commands
