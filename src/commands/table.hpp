#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/text.hpp"

namespace panelgate::commands {

enum class Colour : std::uint8_t { none, good, warning, bad, heading };

struct Cell {
    Cell(std::string with, Colour in = Colour::none) : text(std::move(with)), colour(in) {}
    Cell(const char* with) : text(with) {}

    std::string text;
    Colour colour = Colour::none;
};

/// A table of aligned columns, two spaces between them, nothing behind the last.
class TextTable {
  public:
    /// A heading that begins with '>' is of a column that is aligned to the right.
    explicit TextTable(std::vector<std::string> headings);

    void add(std::vector<Cell> row);
    bool empty() const { return rows_.empty(); }
    /// Headings, if any is not empty, and rows, each line with its end.
    std::string text(bool coloured) const;

  private:
    std::string line(const std::vector<Cell>& row, const std::vector<std::size_t>& widths,
                     bool coloured) const;

    std::vector<Cell> headings_;
    std::vector<bool> right_;
    std::vector<std::vector<Cell>> rows_;
};

/// `text` in a colour for a terminal.
std::string painted(const std::string& text, Colour colour, bool coloured);
/// Colours are for terminals, and not for who has set NO_COLOR (no-color.org) or has a dumb one.
bool wants_colours(bool is_terminal, const char* no_color, const char* term);
/// Characters of UTF-8.
std::size_t width_of(std::string_view text);

/// What a screen has room for, without a line end at the end: cut lines, and the last line last.
/// `rows` is at least 2.
std::string cut_to_screen(std::string_view text, std::size_t rows, std::size_t columns);

/// "0.4 s", "35 s", "12 min", "3 h", "5 d".
std::string span_text(double seconds);
/// "7.4 ms", "1.2 s"; "-" for nothing.
std::string latency_text(double seconds);

}  // namespace panelgate::commands
