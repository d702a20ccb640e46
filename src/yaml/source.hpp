#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

/// Between { and } the braces of `${NAME:-default}` would end the list or map around it. Masked,
/// it has bytes instead that mean nothing to a YAML parser and that no UTF-8 text has; the length
/// is the same, so marks stay true.
std::string mask_variables(std::string_view text);
/// What was written, of a text that came out of a masked one.
std::string unmask_variables(std::string text);

/// A decoded text and its lines. Columns count characters, as editors do; yaml-cpp counts bytes.
class Source {
  public:
    explicit Source(std::string all);

    std::string_view text() const { return text_; }
    /// The last place of the text when `offset` is behind it.
    Mark mark(std::size_t offset) const;
    /// Of a place as yaml-cpp tells it: from 0, the column in bytes.
    Mark mark(int line, int column) const;
    /// Without its end; empty when there is none of that number (from 1).
    std::string_view line(int number) const;
    /// At a place as yaml-cpp tells it; '\n' behind the end.
    char byte(int line, int column) const;
    /// The line and a `^` below the column, each ended by '\n'; a long line is cut around it.
    std::string excerpt(Mark mark) const;

  private:
    std::size_t characters(std::size_t from, std::size_t to) const;

    std::string text_;
    std::vector<std::size_t> lines_;   ///< where each begins
    std::vector<std::size_t> inside_;  ///< bytes inside characters before each 64th byte
};

}  // namespace panelgate::yaml
