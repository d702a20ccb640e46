#include "load_serial.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

#include "line_hints.hpp"

namespace panelgate::config {
namespace {

using yaml::MapReader;
using yaml::Node;

/// RTU has 8, ASCII 7 as a rule, and 8 where panels have it so (serial line V1.02, 2.5.1, 2.5.2).
void load_data_bits(MapReader& in, SerialFormat& format) {
    const bool ascii = format.mode == SerialMode::ascii;
    const auto bits = in.integer("data_bits", 0, 99).value_or(ascii ? 7 : 8);
    in.within("data_bits", 7, 8);
    format.data_bits = bits == 7 && ascii ? 7 : 8;
    if (bits == format.data_bits) return;
    in.problem("data_bits", bits == 7 ? "RTU needs 8 data bits; 7 is for ASCII mode"
                                      : "data_bits must be " + std::string(ascii ? "7 or " : "") +
                                            "8, not '" + std::to_string(bits) + '\'');
}

/// The keys of `serial` that say what is said with the characters. Those of a line; of a port that
/// is none, the mode stands elsewhere.
void load_serial_mode(MapReader& in, SerialFormat& format, modbus::HexDigits* digits) {
    if (digits == nullptr) {
        if (!in.has("mode")) return;
        in.problem("mode",
                   "a serial master's mode is its framing; write framing: ascii beside "
                   "serial, or leave it out for RTU");
        format.mode = SerialMode::ascii;  // which goes with any data bits
        return;
    }
    constexpr std::array<std::pair<std::string_view, modbus::HexDigits>, 2> kLowerCase{
        {{"refuse", modbus::HexDigits::upper_only}, {"take", modbus::HexDigits::any_case}}};
    format.mode = in.choice<SerialMode>("mode", kSerialModeWords).value_or(format.mode);
    *digits = in.choice<modbus::HexDigits>("ascii_lower_case", kLowerCase).value_or(*digits);
    constexpr std::array<std::string_view, 1> kAscii{"ascii"};
    in.belongs("ascii_lower_case", "mode", kAscii);
    if (in.has("ascii_lower_case") && format.mode != SerialMode::ascii)
        in.problem("ascii_lower_case", "only a line with mode: ascii has hex digits");
}

}  // namespace

bool load_serial(Loading& loading, MapReader& line, SerialFormat& format,
                 modbus::HexDigits* digits) {
    const std::size_t before = loading.problems.list().size();
    if (format.mode == SerialMode::ascii) format.data_bits = 7;
    const Node* typed = line.child("serial");
    const std::string example = serial_example(typed);
    const bool is_list = typed != nullptr && typed->kind == Node::Kind::sequence;
    const bool is_values = is_list && std::ranges::all_of(typed->items, [](const Node& item) {
                               return item.kind == Node::Kind::scalar;
                           });
    if (is_values && !typed->items.empty()) {  // [9600, 8, N, 1]
        line.has("serial");
        line.problem("serial", "serial must be a map of keys, not a list; write " + example);
        return false;
    }
    const Node* node = line.map("serial", example);
    if (node == nullptr) return loading.problems.list().size() == before;
    MapReader in(*node, loading.problems, "serial");
    format.baud = static_cast<int>(in.integer("baud", 50, 4'000'000).value_or(format.baud));
    load_serial_mode(in, format, digits);
    load_data_bits(in, format);
    format.parity = in.choice<Parity>("parity", kParityWords).value_or(format.parity);
    format.stop_bits = static_cast<int>(in.integer("stop_bits", 1, 2).value_or(format.stop_bits));
    in.finish();
    return loading.problems.list().size() == before;
}

}  // namespace panelgate::config
