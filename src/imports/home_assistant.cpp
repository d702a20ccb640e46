// `modbus:` of Home Assistant's configuration.yaml.

#include <array>
#include <cstdlib>
#include <utility>

#include "draft.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::imports {

namespace {

using modbus::Table;
using points::Type;
using points::WordOrder;
using yaml::Node;

constexpr auto kHomeTypes =
    std::to_array<std::pair<std::string_view, Type>>({{"int16", Type::i16},
                                                      {"uint16", Type::u16},
                                                      {"int32", Type::i32},
                                                      {"uint32", Type::u32},
                                                      {"int64", Type::i64},
                                                      {"uint64", Type::u64},
                                                      {"float16", Type::f16},
                                                      {"float32", Type::f32},
                                                      {"float64", Type::f64},
                                                      {"string", Type::string}});
constexpr auto kSwaps =
    std::to_array<std::pair<std::string_view, WordOrder>>({{"", WordOrder::abcd},
                                                           {"none", WordOrder::abcd},
                                                           {"byte", WordOrder::badc},
                                                           {"word", WordOrder::cdab},
                                                           {"word_byte", WordOrder::dcba}});
constexpr auto kHomeTables =
    std::to_array<std::pair<std::string_view, Table>>({{"coil", Table::coils},
                                                       {"coils", Table::coils},
                                                       {"discrete_input", Table::discrete_inputs},
                                                       {"input", Table::input_registers},
                                                       {"holding", Table::holding_registers},
                                                       {"holdings", Table::holding_registers}});

std::string text(const Node& in, std::string_view key, std::string_view otherwise = "") {
    const Node* const found = in.find(key);
    return found == nullptr || found->scalar.empty() ? std::string(otherwise) : found->scalar;
}

/// Whole numbers, also hexadecimal; 0 for other texts.
std::int64_t integer(const std::string& text) { return std::strtoll(text.c_str(), nullptr, 0); }

std::int64_t station_of(const Node& entity) {
    return integer(text(entity, "slave", text(entity, "device_address", "1")));
}

/// Fills in type and place; returns what prevents it, or "".
std::string read_place(const Node& entity, bool is_binary, points::Point& point) {
    const std::string kind =
        text(entity, "input_type", text(entity, "write_type", is_binary ? "coil" : "holding"));
    const auto table = look_up(kHomeTables, kind);
    if (!table) return "the input type '" + kind + "'";
    if (entity.find("address") == nullptr) return "it has no address";
    point.table = *table;
    point.at = notation(*table, integer(text(entity, "address")));
    if (modbus::is_bit_table(*table)) point.type = Type::boolean;
    return "";
}

std::string read_number(const Node& sensor, points::Point& point) {
    const std::string type = text(sensor, "data_type", "int16");
    const auto known = look_up(kHomeTypes, type);
    if (!known) return "the data type '" + type + "'";
    const auto order = look_up(kSwaps, text(sensor, "swap"));
    if (!order) return "swap: " + text(sensor, "swap");
    point.type = *known;
    point.word_order = *order;
    if (*known == Type::string)
        point.length = static_cast<unsigned>(2 * integer(text(sensor, "count", "1")));
    point.scale = std::strtod(text(sensor, "scale", "1").c_str(), nullptr);
    point.offset = std::strtod(text(sensor, "offset", "0").c_str(), nullptr);
    point.unit = text(sensor, "unit_of_measurement");
    return "";
}

class Hub {
  public:
    Hub(const Node& hub, Draft& draft) : hub_(hub), draft_(draft), line_(make_line()) {}

    void read() {
        for (const yaml::Entry& entry : hub_.entries) {
            if (entry.value.kind != Node::Kind::sequence) continue;
            for (const Node& entity : entry.value.items) read(entry.key, entity);
        }
    }

  private:
    std::size_t make_line() {
        const std::string type = text(hub_, "type");
        const std::string name = text(hub_, "name", "modbus");
        const std::string port = text(hub_, "port");
        if (type != "serial") {
            const bool rtu = type == "rtuovertcp";
            if (type == "udp") draft_.note(hub_.mark.line, name + ": type udp; TCP is taken");
            return draft_.line(name,
                               (rtu ? "tcp://" : "modbus-tcp://") + text(hub_, "host") + ':' +
                                   (port.empty() ? "502" : port),
                               "");
        }
        return draft_.line(name, port,
                           serial_map(text(hub_, "baudrate", "9600"), text(hub_, "bytesize", "8"),
                                      text(hub_, "parity", "N"), text(hub_, "stopbits", "1"),
                                      text(hub_, "method") == "ascii"));
    }

    void read(const std::string& list, const Node& entity) {
        Tag tag{text(entity, "name", list)};
        const bool is_sensor = list == "sensors";
        const bool is_switch = list == "switches" || list == "lights" || list == "fans";
        const bool is_known = is_sensor || is_switch || list == "binary_sensors";
        std::string fault = is_known ? read_place(entity, !is_sensor && !is_switch, tag.point)
                                     : list + " are not known here";
        if (fault.empty() && is_sensor) fault = read_number(entity, tag.point);
        if (!fault.empty()) return draft_.note(entity.mark.line, tag.name + ": " + fault);
        if (list == "lights" || list == "fans")
            draft_.note(entity.mark.line, tag.name + ": all but its register");
        tag.point.writable = is_switch;
        const std::int64_t seconds = integer(text(entity, "scan_interval", "15"));
        if (seconds > 0) tag.point.every = std::chrono::seconds(seconds);
        draft_.add(line_, station_of(entity), tag);
    }

    const Node& hub_;
    Draft& draft_;
    std::size_t line_;
};

}  // namespace

std::optional<Imported> import_home_assistant(std::string_view file, yaml::Problems& problems) {
    const Node whole = yaml::parse(file, problems);
    const Node* const hubs = whole.find("modbus");
    if (hubs == nullptr || !problems.empty()) return std::nullopt;
    Draft draft("Home Assistant", problems.file());
    for (const Node& hub : hubs->items) Hub(hub, draft).read();
    return draft.made();
}

}  // namespace panelgate::imports
