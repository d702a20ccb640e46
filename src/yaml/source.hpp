#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

/// Replaces special characters of `${NAME:-default}` by bytes without a meaning to a YAML parser,
/// which no UTF-8 text has: between { and } its braces would end the list or map. The length stays,
/// so marks remain valid.
std::string mask_variables(std::string_view text);
/// Restores text that was masked.
std::string unmask_variables(std::string text);

/// A decoded text and its lines. Columns count characters, as editors do; yaml-cpp counts bytes.
class Source {
  public:
    explicit Source(std::string all);

    std::string_view text() const { return text_; }
    /// Returns the mark of an offset; the end of the text if it is beyond.
    Mark mark(std::size_t offset) const;
    /// Converts a place of yaml-cpp: from 0, the column in bytes.
    Mark mark(int line, int column) const;
    /// Returns the offset where the line (from 1) ends; the end of the text if it has no such line.
    std::size_t end_of(int line) const;
    /// Returns the text of a line (from 1) without the line end; empty beyond the last line.
    std::string_view line(int number) const;
    /// Returns the byte at a place of yaml-cpp; '\n' beyond the end.
    char byte(int line, int column) const;
    /// Returns the line and a `^` below the column, each ended by '\n'; a long line is cut around
    /// it.
    std::string excerpt(Mark mark) const;

  private:
    std::size_t characters(std::size_t from, std::size_t to) const;

    std::string text_;
    std::vector<std::size_t> lines_;   ///< where each begins
    std::vector<std::size_t> inside_;  ///< continuation bytes before each 64th byte
};

}  // namespace panelgate::yaml
