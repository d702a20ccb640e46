#include "check_profile.hpp"

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>

#include "panelgate/modbus/function.hpp"

namespace panelgate::profile {
namespace {

using modbus::Table;

constexpr unsigned kMostBits = 2040;  // the byte count is one byte: 255 data bytes
constexpr unsigned kMostWords = 127;

/// User-defined function codes (AP 5).
bool is_user_defined(std::uint8_t code) {
    return (code >= 65 && code <= 72) || (code >= 100 && code <= 110);
}

/// Returns the maximum items of a frame with this function; 0 for functions without a quantity.
unsigned most_items(std::uint8_t code) {
    switch (code) {
        case modbus::kReadCoils:
        case modbus::kReadDiscreteInputs:
        case modbus::kWriteMultipleCoils:
            return kMostBits;
        case modbus::kReadHoldingRegisters:
        case modbus::kReadInputRegisters:
        case modbus::kWriteMultipleRegisters:
        case modbus::kReadWriteMultipleRegisters:
            return kMostWords;
        default:
            return 0;
    }
}

std::string quoted(std::string_view name) { return '\'' + std::string(name) + '\''; }

std::string max_problem(const FunctionRule& rule) {
    const unsigned most = most_items(rule.code);
    const std::string function = "function " + std::to_string(rule.code);
    if (rule.max_count == 0 || rule.max_count <= most) return {};
    if (most == 0) return function + " has no quantity, so no max";
    return "max of " + function + " can be " + std::to_string(most) +
           " at most: the byte count is one byte";
}

bool same_text(std::string_view a, std::string_view b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](unsigned char x, unsigned char y) {
        return std::toupper(x) == std::toupper(y);
    });
}

bool overlap(const AddressRange& a, const AddressRange& b) {
    return a.first <= b.last && b.first <= a.last;
}

std::string table_problem(const Area& area) {
    const bool read_only =
        area.table == Table::discrete_inputs || area.table == Table::input_registers;
    if (area.writable && read_only) {
        return std::string(modbus::label(area.table)) + " cannot be written: no writable here";
    }
    for (const Table table : area.also) {
        if (modbus::is_bit_table(table) != modbus::is_bit_table(area.table))
            return "also must list tables of the same kind: bits or words";
    }
    return {};
}

std::string notation_problem(const Area& area) {
    const Notation& notation = area.notation;
    const bool plain = std::all_of(notation.prefix.begin(), notation.prefix.end(),
                                   [](unsigned char c) { return std::isalnum(c) != 0; });
    if (!plain) return "prefix must be letters and digits, not " + quoted(notation.prefix);
    if (notation.short_digits != 0 && notation.short_digits >= notation.digits)
        return "short_digits must be fewer than digits";
    const std::size_t longest = std::to_string(area.readable.last + notation.base).size();
    if (notation.digits != 0 && longest > notation.digits)
        return "digits are too few for the last item, which needs " + std::to_string(longest);
    return {};
}

std::string view_problem(const PanelProfile& profile, const Area& area) {
    if (area.view_of.empty()) return {};
    if (!modbus::is_bit_table(area.table)) return "only an area of bits can be a view_of words";
    const Area* words = profile.find_area(std::string_view(area.view_of));
    if (words == nullptr || modbus::is_bit_table(words->table))
        return "view_of must name a word area, not " + quoted(area.view_of);
    const AddressRange bits{words->readable.first * kBitsPerWord,
                            words->readable.last * kBitsPerWord + kBitsPerWord - 1};
    if (!bits.contains(area.readable.first) || !bits.contains(area.readable.last))
        return "readable has bits outside the words of " + area.view_of;
    return {};
}

/// Items that an earlier area matches by the same text could never be named.
std::string conflict_problem(const PanelProfile& profile, const Area& area) {
    for (const Area& earlier : profile.areas) {
        if (&earlier == &area) return {};
        if (earlier.name == area.name) return "there are two areas " + quoted(area.name);
        if (earlier.notation.bit == area.notation.bit &&
            same_text(earlier.notation.prefix, area.notation.prefix) &&
            overlap(earlier.readable, area.readable)) {
            return "areas " + quoted(earlier.name) + " and " + quoted(area.name) +
                   " share prefix and addresses";
        }
    }
    return {};
}

}  // namespace

void check_functions(const PanelProfile& profile, const yaml::Node& functions,
                     yaml::Problems& problems) {
    for (std::size_t i = 0; i < profile.functions.size(); ++i) {
        const FunctionRule& rule = profile.functions[i];
        const yaml::Mark mark = functions.items[i].mark;
        const std::string code = std::to_string(rule.code);
        if (!modbus::is_known(rule.code) && !is_user_defined(rule.code))
            problems.add(mark, "function " + code +
                                   " is neither the standard's nor user-defined (65 to 72, 100 "
                                   "to 110)");
        if (rule.broadcast && !modbus::is_broadcastable(rule.code))
            problems.add(mark, "only functions 5, 6, 15 and 16 can be broadcast, not " + code);
        if (profile.find_function(rule.code) != &rule)
            problems.add(mark, "function " + code + " is there twice");
        if (std::string why = max_problem(rule); !why.empty()) problems.add(mark, std::move(why));
    }
}

void check_areas(const PanelProfile& profile, const yaml::Node& areas, yaml::Problems& problems) {
    for (std::size_t i = 0; i < profile.areas.size(); ++i) {
        const Area& area = profile.areas[i];
        for (std::string why : {table_problem(area), notation_problem(area),
                                view_problem(profile, area), conflict_problem(profile, area)}) {
            if (!why.empty()) problems.add(areas.items[i].mark, std::move(why));
        }
    }
}

void check_serial(const Serial& settings, const yaml::Node& serial, yaml::Problems& problems) {
    const auto allows = [](const auto& list, const auto& value) {
        return list.empty() || std::find(list.begin(), list.end(), value) != list.end();
    };
    const SerialFormat& standard = settings.default_format;
    if (!allows(settings.baud, standard.baud) || !allows(settings.parity, standard.parity) ||
        !allows(settings.stop_bits, standard.stop_bits)) {
        problems.add(serial.mark,
                     "default " + to_string(standard) + " is not among what serial allows");
    }
}

}  // namespace panelgate::profile
