// `modbus:` of Home Assistant's configuration.yaml.

#include "source.hpp"

namespace panelgate::imports {

namespace {

using modbus::Table;
using points::Type;
using yaml::Node;

constexpr std::string_view kHomeTypes =
    "int16=i16 uint16=u16 int32=i32 uint32=u32 int64=i64 uint64=u64 float16=f16 float32=f32 "
    "float64=f64 string=string";
constexpr std::string_view kSwaps = "none=ABCD byte=BADC word=CDAB word_byte=DCBA";
constexpr std::string_view kHomeTables =
    "coil=coils discrete_input=discrete-inputs input=input-registers holding=holding-registers";

/// Empties the values with tags, such as !secret: what a tag stands for is not in this file.
void remove_tagged(Node& node, const std::set<std::pair<int, int>>& tagged) {
    for (Node& item : node.items) remove_tagged(item, tagged);
    for (yaml::Entry& entry : node.entries) remove_tagged(entry.value, tagged);
    if (!tagged.contains({node.mark.line, node.mark.column})) return;
    const yaml::Mark mark = node.mark;
    node = {};
    node.mark = mark;
}

/// Parses YAML in which tags are no problems.
Node parse_tagged(std::string_view text, yaml::Problems& problems) {
    yaml::Problems found(problems.file());
    Node whole = yaml::parse(text, found);
    std::set<std::pair<int, int>> tagged;
    for (const yaml::Problem& problem : found.list()) {
        if (problem.message.starts_with("a tag ("))
            tagged.emplace(problem.mark.line, problem.mark.column);
        else
            problems.add(problem);
    }
    remove_tagged(whole, tagged);
    return whole;
}

void read_number(Source& sensor, points::Point& point) {
    const std::string type = sensor.text("data_type", "int16");
    const std::string swap = sensor.text("swap", "none");
    const auto known = meaning(kHomeTypes, type, kTypes);
    const auto order = meaning(kSwaps, swap, kOrders);
    if (!known) return sensor.fail("the data type '" + type + '\'');
    if (!order) return sensor.fail("swap '" + swap + '\'');
    point.type = *known;
    point.word_order = *order;
    point.unit = sensor.guess("unit_of_measurement", text_itself).value_or("");
    if (*known == Type::string) {
        point.length = 2 * static_cast<unsigned>(sensor.get("count", integer_of, 1));
        return;
    }
    point.scale = sensor.get("scale", number_of, 1);
    point.offset = sensor.get("offset", number_of, 0);
    if (!points::is_integer(*known)) return;
    if (const auto none = sensor.guess("nan_value", integer_of)) point.no_value.push_back(*none);
}

void read_entity(const Node& node, const std::string& list, std::int64_t line, Draft& draft) {
    Source in(node, list, draft);
    Tag tag{in.name(), in.line()};
    const bool is_sensor = list == "sensors";
    const bool is_binary = list == "binary_sensors";
    std::string kind = in.text(is_sensor || is_binary ? "input_type" : "write_type",
                               is_binary ? "coil" : "holding");
    if (kind == "coils" || kind == "holdings") kind.pop_back();
    const auto table = meaning(kHomeTables, kind, modbus::kTables);
    if (!table) in.fail("the input type '" + kind + '\'');
    tag.point.table = table.value_or(Table::coils);
    in.needed("address");
    tag.address = in.get("address", integer_of, 0);
    if (modbus::is_bit_table(tag.point.table)) {
        tag.point.type = Type::boolean;
    } else if (is_binary) {
        tag.point.type = Type::boolean;
        tag.point.bit = 0;
    } else if (is_sensor) {
        read_number(in, tag.point);
    }
    tag.point.writable = !is_sensor && !is_binary;
    tag.point.every = in.get("scan_interval", duration_of, 15s);
    const std::int64_t station =
        in.get("slave", integer_of, in.get("device_address", integer_of, 1));
    if (in.finish()) draft.add(line, station, tag);
}

void read_hub(const Node& node, Draft& draft) {
    Source in(node, "modbus", draft);
    LineBody body{in.name(), in.line()};
    const std::string type = in.text("type");
    if (type == "serial") {
        body.device = in.needed("port");
        body.serial =
            serial_map(in, "baudrate", "bytesize", "stopbits", in.text("method") == "ascii");
    } else if (type == "tcp" || type == "rtuovertcp") {
        std::string host = in.needed("host");
        if (host.find(':') != host.npos && !host.starts_with('[')) host = '[' + host + ']';
        body.device =
            (type == "tcp" ? "modbus-tcp://" : "tcp://") + host + ':' + in.text("port", "502");
    } else {
        in.fail("type '" + type + '\'');
    }
    const auto timeout = in.guess("timeout", duration_of);
    auto gap = in.guess("message_wait_milliseconds", duration_of);
    if (gap) gap = *gap / 1000;  // the key is in milliseconds
    body.waits = waits_of(timeout, gap, in.guess("delay", duration_of));
    const auto line = in.is_fine() ? draft.line(body) : std::nullopt;
    if (!line) in.fail("its port is another line's, with other settings");
    for (const char* const list : {"sensors", "binary_sensors", "switches", "lights", "fans"})
        for (const Node* const entity : in.list(list))
            if (line) read_entity(*entity, list, *line, draft);
    in.finish();
}

}  // namespace

void read_home_assistant(std::string_view file, yaml::Problems& problems, Draft& draft) {
    const Node whole = parse_tagged(file, problems);
    if (!problems.empty()) return;
    Source all(whole, "the file", draft);
    for (const Node* const hub : all.list("modbus")) read_hub(*hub, draft);
}

}  // namespace panelgate::imports
