// [[inputs.modbus]] of a telegraf.conf, in its styles register, request and metric.

#define TOML_HEADER_ONLY 1
#define TOML_EXCEPTIONS 0
#include <toml++/toml.h>

#include <array>
#include <utility>

#include "draft.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::imports {

namespace {

using modbus::Table;
using points::Type;
using points::WordOrder;

constexpr auto kTelegrafTypes =
    std::to_array<std::pair<std::string_view, Type>>({{"INT8L", Type::i8l},
                                                      {"INT8H", Type::i8h},
                                                      {"UINT8L", Type::u8l},
                                                      {"UINT8H", Type::u8h},
                                                      {"INT16", Type::i16},
                                                      {"UINT16", Type::u16},
                                                      {"INT32", Type::i32},
                                                      {"UINT32", Type::u32},
                                                      {"INT64", Type::i64},
                                                      {"UINT64", Type::u64},
                                                      {"FLOAT16-IEEE", Type::f16},
                                                      {"FLOAT32-IEEE", Type::f32},
                                                      {"FLOAT64-IEEE", Type::f64},
                                                      {"FLOAT16", Type::f16},
                                                      {"FLOAT32", Type::f32},
                                                      {"FLOAT64", Type::f64},
                                                      {"STRING", Type::string},
                                                      {"BIT", Type::boolean}});
constexpr auto kOrders =
    std::to_array<std::pair<std::string_view, WordOrder>>({{"AB", WordOrder::abcd},
                                                           {"BA", WordOrder::badc},
                                                           {"ABCD", WordOrder::abcd},
                                                           {"DCBA", WordOrder::dcba},
                                                           {"BADC", WordOrder::badc},
                                                           {"CDAB", WordOrder::cdab},
                                                           {"ABCDEFGH", WordOrder::abcd},
                                                           {"HGFEDCBA", WordOrder::dcba},
                                                           {"BADCFEHG", WordOrder::badc},
                                                           {"GHEFCDAB", WordOrder::cdab}});
constexpr auto kTelegrafTables =
    std::to_array<std::pair<std::string_view, Table>>({{"coil", Table::coils},
                                                       {"discrete", Table::discrete_inputs},
                                                       {"input", Table::input_registers},
                                                       {"holding", Table::holding_registers}});

std::string text(const toml::table& in, std::string_view key, std::string_view otherwise = "") {
    return in[key].value<std::string>().value_or(std::string(otherwise));
}

int line_of(const toml::node& node) { return static_cast<int>(node.source().begin.line); }

/// One plugin of the file while its fields are read.
class Plugin {
  public:
    Plugin(const toml::table& of, Duration every, Draft& draft)
        : of_(of), every_(every), draft_(draft), line_(make_line()) {
        if (const auto own = yaml::parse_duration(text(of, "interval"))) every_ = *own;
    }

    void read() {
        const std::int64_t station = of_["slave_id"].value_or<std::int64_t>(1);
        for (const auto& [key, table] : {std::pair("coils", Table::coils),
                                         std::pair("discrete_inputs", Table::discrete_inputs),
                                         std::pair("input_registers", Table::input_registers),
                                         std::pair("holding_registers", Table::holding_registers)})
            each(of_, key, [&](const toml::table& field) { add(station, table, field, ""); });
        for (const char* const key : {"request", "metric"})
            each(of_, key, [&](const toml::table& group) { read_group(group); });
    }

  private:
    template <class Use>
    static void each(const toml::table& in, std::string_view key, const Use& use) {
        if (const toml::array* const list = in[key].as_array())
            for (const toml::node& one : *list)
                if (const toml::table* const table = one.as_table()) use(*table);
    }

    std::size_t make_line() {
        const std::string controller = text(of_, "controller");
        const std::string mode = text(of_, "transmission_mode");
        const std::string place =
            controller.substr(std::min(controller.find("://") + 3, controller.size()));
        const bool ascii = mode.starts_with("ASCII");
        if (controller.starts_with("tcp://"))
            return draft_.line(text(of_, "name", "device"),
                               (mode.empty() || mode == "TCP" ? "modbus-tcp://" : "tcp://") + place,
                               ascii ? "{mode: ascii}" : "");
        const auto number = [&](std::string_view key, std::int64_t otherwise) {
            return std::to_string(of_[key].value_or(otherwise));
        };
        return draft_.line(text(of_, "name", "device"), place.empty() ? "/dev/ttyUSB0" : place,
                           serial_map(number("baud_rate", 9600), number("data_bits", 8),
                                      text(of_, "parity", "N"), number("stop_bits", 1), ascii));
    }

    void read_group(const toml::table& group) {
        const std::int64_t station = group["slave_id"].value_or<std::int64_t>(1);
        each(group, "fields", [&](const toml::table& field) {
            const auto table = look_up(kTelegrafTables,
                                       text(field, "register", text(group, "register", "holding")));
            if (table) add(station, *table, field, text(group, "byte_order", "ABCD"));
        });
    }

    /// `order`: of the group; "": the field has its own.
    void add(std::int64_t station, Table table, const toml::table& field, std::string_view order) {
        Tag tag{text(field, "name", "field")};
        const auto refuse = [&](const std::string& what) {
            draft_.note(line_of(field), tag.name + ": " + what);
        };
        const toml::array* const list = field["address"].as_array();
        const auto address = list != nullptr ? (*list)[0].value<std::int64_t>()
                                             : field["address"].value<std::int64_t>();
        if (!address) return refuse("it has no address");
        const auto count = list != nullptr ? list->size() : 1;
        tag.point.at = notation(table, *address);
        tag.point.every = every_;
        const bool is_bit = modbus::is_bit_table(table);
        const std::string type = text(field, "data_type", text(field, "type", "UINT16"));
        const auto known = is_bit ? Type::boolean : type_of(type, count);
        if (!known) return refuse("the type '" + type + "'");
        tag.point.type = *known;
        if (*known == Type::boolean && !is_bit)
            tag.point.bit = static_cast<unsigned>(field["bit"].value_or<std::int64_t>(0));
        if (*known == Type::string)
            tag.point.length = static_cast<unsigned>(
                2 * field["length"].value_or(static_cast<std::int64_t>(count)));
        const auto word = look_up(kOrders, order.empty() ? text(field, "byte_order", "AB") : order);
        if (!word) return refuse("the byte order '" + text(field, "byte_order") + "'");
        if (!is_bit) tag.point.word_order = *word;
        tag.point.scale = field["scale"].value<double>().value_or(1.0);
        if (field["omit"].value_or(false)) return;
        draft_.add(line_, station, tag);
    }

    /// FIXED and UFIXED are integers of as many registers as there are addresses.
    static std::optional<Type> type_of(const std::string& type, std::size_t registers) {
        const bool fixed = type == "FIXED";
        if (!fixed && type != "UFIXED") return look_up(kTelegrafTypes, type);
        if (registers == 1) return fixed ? Type::i16 : Type::u16;
        if (registers == 2) return fixed ? Type::i32 : Type::u32;
        return registers == 4 ? std::optional(fixed ? Type::i64 : Type::u64) : std::nullopt;
    }

    const toml::table& of_;
    Duration every_;
    Draft& draft_;
    std::size_t line_;
};

}  // namespace

std::optional<Imported> import_telegraf(std::string_view file, yaml::Problems& problems) {
    const toml::parse_result parsed = toml::parse(file, problems.file());
    if (!parsed) {
        const auto at = parsed.error().source().begin;
        problems.add({static_cast<int>(at.line), static_cast<int>(at.column)},
                     "this is no TOML: " + std::string(parsed.error().description()));
        return std::nullopt;
    }
    const toml::table& whole = parsed.table();
    Draft draft("Telegraf", problems.file());
    const auto every =
        yaml::parse_duration(whole["agent"]["interval"].value<std::string>().value_or("10s"));
    if (const toml::array* const plugins = whole["inputs"]["modbus"].as_array())
        for (const toml::node& one : *plugins)
            if (const toml::table* const plugin = one.as_table())
                Plugin(*plugin, every.value_or(10s), draft).read();
    return draft.made();
}

}  // namespace panelgate::imports
