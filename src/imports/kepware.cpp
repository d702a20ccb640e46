// Kepware's CSV of the tags of one Modbus device (KEPServerEX, Import/Export CSV).

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <map>
#include <utility>

#include "draft.hpp"
#include "panelgate/base/csv.hpp"

namespace panelgate::imports {

namespace {

using modbus::Table;
using points::Type;

constexpr auto kKepwareTypes =
    std::to_array<std::pair<std::string_view, Type>>({{"Boolean", Type::boolean},
                                                      {"Word", Type::u16},
                                                      {"Short", Type::i16},
                                                      {"DWord", Type::u32},
                                                      {"Long", Type::i32},
                                                      {"QWord", Type::u64},
                                                      {"LLong", Type::i64},
                                                      {"Float", Type::f32},
                                                      {"Double", Type::f64},
                                                      {"BCD", Type::bcd16},
                                                      {"LBCD", Type::bcd32},
                                                      {"String", Type::string}});

/// A row by the names of its columns.
class Row {
  public:
    Row(const CsvRow& head, const CsvRow& row) : line(row.line) {
        for (std::size_t i = 0; i < std::min(head.cells.size(), row.cells.size()); ++i)
            cells_[head.cells[i]] = row.cells[i];
    }
    std::string operator[](const std::string& column) const {
        const auto found = cells_.find(column);
        return found == cells_.end() ? "" : found->second;
    }
    double number(const std::string& column) const {
        return std::strtod((*this)[column].c_str(), nullptr);
    }

    int line;

  private:
    std::map<std::string, std::string> cells_;
};

/// "400001", "40001", "400001.03" (a bit) or "400001.20H" (a text). False for other addresses.
bool read_address(const std::string& text, points::Point& point) {
    constexpr std::array<std::pair<char, Table>, 4> kDigits{{{'0', Table::coils},
                                                             {'1', Table::discrete_inputs},
                                                             {'3', Table::input_registers},
                                                             {'4', Table::holding_registers}}};
    const std::size_t dot = std::min(text.find('.'), text.size());
    const auto table =
        std::ranges::find(kDigits, text.empty() ? '?' : text[0], &std::pair<char, Table>::first);
    unsigned number = 0;
    const auto [end, wrong] = std::from_chars(text.data() + 1, text.data() + dot, number);
    if (table == kDigits.end() || dot < 5 || dot > 6 || wrong != std::errc() ||
        end != text.data() + dot || number == 0)
        return false;
    point.at = notation(table->second, static_cast<std::int64_t>(number) - 1);
    point.table = table->second;
    if (dot == text.size()) return true;
    unsigned behind = 0;
    const auto [rest, bad] =
        std::from_chars(text.data() + dot + 1, text.data() + text.size(), behind);
    if (bad != std::errc()) return false;
    if (point.type == Type::string) point.length = behind;
    if (point.type == Type::boolean) point.bit = behind;
    return point.type == Type::string || (point.type == Type::boolean && behind < 16);
}

void read_scaling(const Row& row, points::Point& point, Draft& draft) {
    const std::string scaling = row["Scaling"];
    if (scaling.empty() || scaling == "None") return;
    const double raw = row.number("Raw High") - row.number("Raw Low");
    if (scaling != "Linear" || raw == 0)
        return draft.note(row.line, "the scaling '" + scaling + "' of " + row["Tag Name"]);
    point.scale = (row.number("Scaled High") - row.number("Scaled Low")) / raw;
    point.offset = row.number("Scaled Low") - row.number("Raw Low") * point.scale;
}

void add_row(const Row& row, std::size_t line, Draft& draft) {
    Tag tag{row["Tag Name"]};
    const std::string type = row["Data Type"];
    const auto known =
        std::ranges::find(kKepwareTypes, type, &std::pair<std::string_view, Type>::first);
    if (known == kKepwareTypes.end())
        return draft.note(row.line, tag.name + ": the data type '" + type + "'");
    tag.point.type = known->second;
    if (!read_address(row["Address"], tag.point))
        return draft.note(row.line, tag.name + ": the address '" + row["Address"] + "'");
    tag.point.writable = row["Client Access"] == "R/W" || row["Client Access"] == "RW";
    if (points::registers_of(tag.point.type) > 1) tag.point.word_order = points::WordOrder::cdab;
    if (const double rate = row.number("Scan Rate"); rate >= 1)
        tag.point.every = std::chrono::milliseconds(static_cast<std::int64_t>(rate));
    tag.point.unit = row["Eng Units"].empty() ? row["Eng. Units"] : row["Eng Units"];
    read_scaling(row, tag.point, draft);
    draft.add(line, 1, tag);
}

}  // namespace

std::optional<Imported> import_kepware(std::string_view text, yaml::Problems& problems) {
    const Csv csv = parse_csv(text);
    if (!csv.fault.empty()) problems.add({csv.fault_line, 1}, csv.fault);
    if (!problems.empty() || csv.rows.empty()) return std::nullopt;
    Draft draft("Kepware", problems.file());
    draft.note(1, "a CSV of tags names no device: set `device` and the station's `id`");
    draft.note(1,
               "'First word low' of the device, which is on unless it was changed: word_order "
               "CDAB is taken for it; where it is off, delete word_order");
    const std::size_t line = draft.line("kepware", "modbus-tcp://192.0.2.1:502", "");
    for (std::size_t i = 1; i < csv.rows.size(); ++i)
        add_row(Row(csv.rows.front(), csv.rows[i]), line, draft);
    return draft.made();
}

}  // namespace panelgate::imports
