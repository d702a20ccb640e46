// Kepware's CSV of the tags of one Modbus device (KEPServerEX, Import/Export CSV).

#include <algorithm>

#include "panelgate/base/csv.hpp"
#include "panelgate/base/text.hpp"
#include "source.hpp"

namespace panelgate::imports {

namespace {

using points::Type;

constexpr std::string_view kKepwareTypes =
    "Boolean=bool Word=u16 Short=i16 DWord=u32 Long=i32 QWord=u64 LLong=i64 Float=f32 Double=f64 "
    "BCD=bcd16 LBCD=bcd32 String=string";
constexpr std::string_view kKepwareTables =
    "0=coils 1=discrete-inputs 3=input-registers 4=holding-registers";

/// Makes a map of a row. Empty cells are left out, and zeros, which mean the same as empty cells.
yaml::Node node_of(const CsvRow& head, const CsvRow& row) {
    yaml::Node node;
    node.kind = yaml::Node::Kind::map;
    node.mark.line = row.line;
    for (std::size_t i = 0; i < std::min(head.cells.size(), row.cells.size()); ++i) {
        if (row.cells[i].empty() || row.cells[i] == "0") continue;
        yaml::Node cell;
        cell.kind = yaml::Node::Kind::scalar;
        cell.mark = node.mark;
        cell.scalar = row.cells[i];
        node.entries.push_back({head.cells[i], node.mark, cell});
    }
    return node;
}

/// "400001", "40001", "400001.03" (a bit) or "400001.20H" (a text; L: low byte first). False for
/// other addresses.
bool read_address(const std::string& text, Tag& tag) {
    const std::size_t dot = std::min(text.find('.'), text.size());
    const auto table = meaning(kKepwareTables, text.substr(0, 1), modbus::kTables);
    const auto number =
        to_number<std::uint32_t>(text.substr(std::min<std::size_t>(dot, 1), dot - 1));
    if (!table || dot < 5 || dot > 6 || number.value_or(0) == 0) return false;
    tag.address = *number - 1;
    tag.point.table = *table;
    std::string behind = text.substr(std::min(dot + 1, text.size()));
    const bool is_bit = modbus::is_bit_table(*table);
    if (tag.point.type == Type::string && (behind.ends_with('H') || behind.ends_with('L'))) {
        if (behind.back() == 'L') tag.point.word_order = points::WordOrder::badc;
        behind.pop_back();
    }
    const auto count = to_number(behind);
    if (tag.point.type == Type::string) tag.point.length = count.value_or(0);
    if (tag.point.type == Type::boolean && !is_bit) tag.point.bit = count;
    if (tag.point.type == Type::boolean) return is_bit ? behind.empty() : count && *count < 16;
    return !is_bit && (tag.point.type == Type::string ? count.has_value() : behind.empty());
}

void read_scaling(Source& row, points::Point& point) {
    const std::string scaling = row.text("Scaling", "None");
    const double raw = row.get("Raw High", number_of, 0) - row.get("Raw Low", number_of, 0);
    const double low = row.get("Scaled Low", number_of, 0);
    const double high = row.get("Scaled High", number_of, 0);
    row.text("Scaled Data Type");
    if (scaling == "None") return;
    if (scaling != "Linear" || raw == 0) return row.fail("the scaling '" + scaling + '\'');
    const double sign = row.text("Negate Value").empty() ? 1 : -1;
    point.scale = (high - low) / raw * sign;
    point.offset = low * sign - row.get("Raw Low", number_of, 0) * point.scale;
}

void add_row(const yaml::Node& node, std::int64_t line, Draft& draft) {
    Source row(node, "tags", draft, "Tag Name");
    Tag tag{row.name(), row.line()};
    const std::string type = row.text("Data Type");
    const std::string address = row.text("Address");
    const std::string access = row.text("Client Access");
    row.text("Respect Data Type");  // of Kepware's own clients
    const auto known = meaning(kKepwareTypes, type, kTypes);
    if (!known) row.fail("the data type '" + type + '\'');
    tag.point.type = known.value_or(Type::u16);
    if (!read_address(address, tag)) row.fail("the address '" + address + "' of type " + type);
    tag.point.writable = access == "R/W" || access == "RW";
    if (tag.point.type != Type::string && points::registers_of(tag.point.type) > 1)
        tag.point.word_order = points::WordOrder::cdab;
    tag.point.every = std::chrono::milliseconds(row.get("Scan Rate", integer_of, 1000));
    const std::string units = row.text("Eng. Units");
    tag.point.unit = row.text("Eng Units", units);
    read_scaling(row, tag.point);
    if (row.finish()) draft.add(line, 1, tag);
}

}  // namespace

void read_kepware(std::string_view text, yaml::Problems& problems, Draft& draft) {
    const Csv csv = parse_csv(text);
    if (!csv.fault.empty()) problems.add({csv.fault_line, 1}, csv.fault);
    if (!problems.empty() || csv.rows.empty()) return;
    draft.note(1, "a CSV of tags names no device: set `device` and the station's `id`");
    draft.note(1,
               "'First word low' of the device, which is on unless it was changed: word_order "
               "CDAB is taken for it; where it is off, delete word_order");
    const auto line = draft.line({"kepware", 1, "modbus-tcp://192.0.2.1:502"});
    for (std::size_t i = 1; line && i < csv.rows.size(); ++i)
        add_row(node_of(csv.rows.front(), csv.rows[i]), *line, draft);
}

}  // namespace panelgate::imports
