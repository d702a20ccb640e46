#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace panelgate {

struct CsvRow {
    int line = 1;  ///< of the file, where the row begins
    std::vector<std::string> cells{};
};

struct Csv {
    std::vector<CsvRow> rows{};  ///< without empty lines
    std::string fault{};         ///< why reading ended early; "": it did not
    int fault_line = 1;
};

/// Reads comma-separated values (RFC 4180). Also taken: ';' or a tab as the separator, whichever
/// the first line has most; a byte order mark; CR, LF and CR LF.
Csv parse_csv(std::string_view text);

}  // namespace panelgate
