#include <cstdlib>
#include <string>
#include <string_view>

#include "panelgate/base/csv.hpp"

using namespace panelgate;

/// Rows are in the file, in order, and their cells written anew are read as the same cells.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const Csv csv = parse_csv(std::string_view(reinterpret_cast<const char*>(data), size));
    std::string again;
    int line = 0;
    for (const CsvRow& row : csv.rows) {
        if (row.line <= line || row.cells.empty()) std::abort();
        line = row.line;
        for (std::size_t i = 0; i < row.cells.size(); ++i) {
            again += i > 0 ? ",\"" : "\"";
            for (const char c : row.cells[i]) again += c == '"' ? "\"\"" : std::string(1, c);
            again += '"';
        }
        again += "\r\n";
    }
    const Csv other = parse_csv("a,b,c,d,e,f,g,h\r\n" + again);
    if (!other.fault.empty() || other.rows.size() != csv.rows.size() + 1) std::abort();
    for (std::size_t i = 0; i < csv.rows.size(); ++i)
        if (other.rows[i + 1].cells != csv.rows[i].cells) std::abort();
    return 0;
}
