// [[inputs.modbus]] of a telegraf.conf, in its styles register, request and metric.

#define TOML_HEADER_ONLY 1
#define TOML_EXCEPTIONS 0
#define TOML_ASSERT(expr) static_assert(true)  // faults such as [*] break an assertion first
#include <toml++/toml.h>

#include <cmath>

#include "panelgate/base/text.hpp"
#include "source.hpp"

namespace panelgate::imports {

namespace {

using points::Type;
using yaml::Node;

constexpr std::string_view kCommonTypes =
    "INT8L=i8l INT8H=i8h UINT8L=u8l UINT8H=u8h INT16=i16 UINT16=u16 INT32=i32 UINT32=u32 "
    "INT64=i64 UINT64=u64 STRING=string BIT=bool";
constexpr std::string_view kRequestTypes = "FLOAT16=f16 FLOAT32=f32 FLOAT64=f64";
/// Behind FIXED and its like stands the number of addresses; FLOAT32 is the old word for UFIXED.
constexpr std::string_view kRegisterTypes =
    "FLOAT16-IEEE=f16 FLOAT32-IEEE=f32 FLOAT64-IEEE=f64 FIXED/1=i16 FIXED/2=i32 FIXED/4=i64 "
    "UFIXED/1=u16 UFIXED/2=u32 UFIXED/4=u64 FLOAT32/1=u16 FLOAT32/2=u32 FLOAT32/4=u64";
constexpr std::string_view kByteOrders =
    "AB=ABCD BA=BADC ABCD=ABCD DCBA=DCBA BADC=BADC CDAB=CDAB ABCDEFGH=ABCD HGFEDCBA=DCBA "
    "BADCFEHG=BADC GHEFCDAB=CDAB";
constexpr std::string_view kTelegrafTables =
    "coil=coils discrete=discrete-inputs input=input-registers holding=holding-registers";

Node node_of(const toml::node& from) {
    Node node;
    node.mark.line = static_cast<int>(from.source().begin.line);
    if (const toml::table* const table = from.as_table()) {
        node.kind = Node::Kind::map;
        for (const auto& [key, value] : *table)
            node.entries.push_back({std::string(key.str()), {}, node_of(value)});
    } else if (const toml::array* const list = from.as_array()) {
        node.kind = Node::Kind::sequence;
        for (const toml::node& item : *list) node.items.push_back(node_of(item));
    } else {
        node.kind = Node::Kind::scalar;
        const auto truth = from.value_exact<bool>();
        const std::string number = number_text(from.value<double>().value_or(NAN));
        node.scalar =
            truth ? (*truth ? "true" : "false") : from.value<std::string>().value_or(number);
    }
    return node;
}

/// What the fields of one list have in common.
struct Group {
    bool in_register_style = false;
    std::int64_t line = 0;
    std::int64_t station = 0;
    std::string table{};
    std::string order{};  ///< "" where each field has its own
    Duration every{};
};

/// Sets the type, and what belongs to it. `count`: of the addresses.
void read_type(Source& in, const Group& group, std::size_t count, points::Point& point) {
    const bool is_register = group.in_register_style;
    const std::string type = in.text(is_register ? "data_type" : "type");
    const std::string order = group.order.empty() ? in.text("byte_order") : group.order;
    auto known = meaning(kCommonTypes, type, kTypes);
    if (!known) known = meaning(is_register ? kRegisterTypes : kRequestTypes, type, kTypes);
    if (!known && is_register)
        known = meaning(kRegisterTypes, type + '/' + std::to_string(count), kTypes);
    const auto word = meaning(kByteOrders, order, kOrders);
    if (!known)
        return in.fail("the type '" + type + "' of " + std::to_string(count) + " addresses");
    if (!word) return in.fail("the byte order '" + order + '\'');
    point.type = *known;
    point.word_order = *word;
    if (*known == Type::boolean) {
        point.bit = static_cast<unsigned>(in.get("bit", integer_of, 0));
    } else if (*known == Type::string) {
        const auto all = static_cast<std::int64_t>(count);
        point.length =
            2 * static_cast<unsigned>(is_register ? all : in.get("length", integer_of, 1));
    } else {
        point.scale = in.get("scale", number_of, 1);
    }
    if (is_register && *known != Type::string && points::registers_of(*known) != count)
        in.fail(type + " of " + std::to_string(count) + " addresses");
}

void read_field(const Node& node, const Group& group, Draft& draft) {
    Source in(node, group.in_register_style ? group.table : "fields", draft);
    if (in.text("omit") == "true") return;
    Tag tag{in.name(), in.line()};
    const std::string place = in.text("register", group.table);
    const auto table = meaning(kTelegrafTables, place, modbus::kTables);
    if (!table) in.fail("the register '" + place + '\'');
    tag.point.table = table.value_or(modbus::Table::coils);
    const auto addresses = in.list("address");
    for (std::size_t i = 0; i < addresses.size(); ++i) {
        const auto address = integer_of(addresses[i]->scalar);
        if (i == 0) tag.address = address.value_or(0);
        if (!address || *address - tag.address != static_cast<std::int64_t>(i))
            in.fail("its addresses are not in a row");
    }
    if (addresses.empty()) in.fail("it has no address");
    tag.point.every = group.every;
    if (modbus::is_bit_table(tag.point.table))
        tag.point.type = Type::boolean;
    else
        read_type(in, group, addresses.size(), tag.point);
    if (in.finish()) draft.add(group.line, group.station, tag);
}

void read_group(const Node& node, const std::string& style, Group group, Draft& draft) {
    Source in(node, style, draft);
    group.station = in.get("slave_id", integer_of, 0);
    group.order = in.text("byte_order", "ABCD");
    group.table = style == "request" ? in.text("register", "holding") : "holding";
    const auto fields = in.list("fields");
    if (!in.finish()) return;
    for (const Node* const field : fields) read_field(*field, group, draft);
}

/// Sets the device and its serial settings.
void read_controller(Source& in, LineBody& body) {
    const std::string controller = in.needed("controller");
    const std::string mode = in.text("transmission_mode");
    const std::size_t colon = controller.find("://");
    const std::string scheme = colon == controller.npos ? "file" : controller.substr(0, colon);
    std::string place = colon == controller.npos ? controller : controller.substr(colon + 3);
    if (scheme == "tcp") {
        if (place.find(':', place.find(']') + 1) == place.npos) place += ":502";
        body.device = (mode.empty() || mode == "TCP" ? "modbus-tcp://" : "tcp://") + place;
        if (mode.starts_with("ASCII")) body.serial = "{mode: ascii}";
    } else if (scheme == "file") {
        body.device = place;
        body.serial = serial_map(in, "baud_rate", "data_bits", "stop_bits", mode == "ASCII");
    } else {
        in.fail("the controller '" + controller + '\'');
    }
}

void read_fields(Source& in, Group group, Draft& draft) {
    group.in_register_style = true;
    group.station = in.get("slave_id", integer_of, 0);
    for (const auto& [key, table] :
         {std::pair("coils", "coil"), std::pair("discrete_inputs", "discrete"),
          std::pair("input_registers", "input"), std::pair("holding_registers", "holding")}) {
        group.table = table;
        for (const Node* const field : in.list(key)) read_field(*field, group, draft);
    }
}

/// Reads [inputs.modbus.workarounds], too.
void read_waits(Source& in, LineBody& body, Draft& draft) {
    const auto timeout = in.guess("timeout", duration_of);
    body.waits = waits_of(timeout, {}, {});
    for (const Node* const workarounds : in.list("workarounds")) {
        Source more(*workarounds, "workarounds", draft);
        const auto gap = more.guess("pause_between_requests", duration_of);
        body.waits = waits_of(timeout, gap, more.guess("pause_after_connect", duration_of));
        more.finish();
    }
}

void read_plugin(const Node& node, Duration every, Draft& draft) {
    Source in(node, "inputs.modbus", draft);
    LineBody body{in.name(), in.line()};
    if (body.name == "inputs.modbus") body.name = "device";
    read_controller(in, body);
    read_waits(in, body, draft);
    Group group{.every = in.get("interval", duration_of, every)};
    const std::string style = in.text("configuration_type", "register");
    const auto line = in.is_fine() ? draft.line(body) : std::nullopt;
    if (!line) in.fail("its port is another line's, with other settings");
    group.line = line.value_or(0);
    if (line && style == "register") read_fields(in, group, draft);
    if (line && style != "register")
        for (const Node* const one : in.list(style)) read_group(*one, style, group, draft);
    in.finish();
}

}  // namespace

void read_telegraf(std::string_view file, yaml::Problems& problems, Draft& draft) {
    const toml::parse_result parsed = toml::parse(file, problems.file());
    if (!parsed) {
        const auto at = parsed.error().source().begin;
        problems.add({static_cast<int>(at.line), static_cast<int>(at.column)},
                     "this is no TOML: " + std::string(parsed.error().description()));
        return;
    }
    const auto agent = parsed.table()["agent"]["interval"].value<std::string>();
    const auto every = duration_of(agent.value_or("10s"));
    if (const toml::array* const plugins = parsed.table()["inputs"]["modbus"].as_array())
        for (const toml::node& plugin : *plugins)
            read_plugin(node_of(plugin), every.value_or(10s), draft);
}

}  // namespace panelgate::imports
