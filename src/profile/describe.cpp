#include "panelgate/profile/describe.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <initializer_list>
#include <optional>
#include <utility>

#include "panelgate/modbus/function.hpp"

namespace panelgate::profile {
namespace {

using modbus::Table;

constexpr std::array<std::pair<Table, std::string_view>, 4> kSingular{
    {{Table::coils, "coil"},
     {Table::discrete_inputs, "discrete input"},
     {Table::input_registers, "input register"},
     {Table::holding_registers, "holding register"}}};

std::string singular(Table table) {
    return std::string(kSingular[static_cast<std::size_t>(table)].second);
}

/// "coil 288 0x0120"
std::string place(Table table, std::uint16_t address) {
    char hex[8] = {};
    std::snprintf(hex, sizeof hex, "0x%04X", unsigned{address});
    return singular(table) + ' ' + std::to_string(address) + ' ' + hex;
}

std::string range(const Area& area, const AddressRange& addresses) {
    return format_notation(area, static_cast<std::uint16_t>(addresses.first)) + " to " +
           format_notation(area, static_cast<std::uint16_t>(addresses.last));
}

std::string padded(std::string text, std::size_t width) {
    if (text.size() < width) text.resize(width, ' ');
    return text + ' ';
}

template <class T, class Format>
std::string listed(const std::vector<T>& values, const Format& format) {
    std::string text;
    for (const T& value : values) text += (text.empty() ? "" : ", ") + format(value);
    return text.empty() ? "any" : text;
}

std::string cited(const std::string& source) { return source.empty() ? "" : "  [" + source + ']'; }

/// Returns those of `codes` that the profile has: "5, 15", or "none".
std::string supported_of(const PanelProfile& profile, std::initializer_list<std::uint8_t> codes) {
    std::string text;
    for (const std::uint8_t code : codes) {
        if (profile.find_function(code) == nullptr) continue;
        text += (text.empty() ? "" : ", ") + std::to_string(code);
    }
    return text.empty() ? "none" : text;
}

/// Returns the profile's functions that read and write this table.
std::string functions_of(const PanelProfile& profile, Table table, bool writable) {
    using namespace modbus;
    const bool words = table == Table::holding_registers;
    const std::string reads =
        words ? supported_of(profile, {kReadHoldingRegisters, kReadWriteMultipleRegisters})
              : supported_of(profile, {read_function(table)});
    std::string writes = "none";
    if (writable && words) {
        writes = supported_of(profile, {kWriteSingleRegister, kWriteMultipleRegisters,
                                        kMaskWriteRegister, kReadWriteMultipleRegisters});
    } else if (writable && table == Table::coils) {
        writes = supported_of(profile, {kWriteSingleCoil, kWriteMultipleCoils});
    }
    return "read by function " + reads + ", written by " + writes;
}

/// Returns the same memory in the profile's other notations.
std::string other_notations(const PanelProfile& profile, const Area& area, std::uint16_t address) {
    if (!area.view_of.empty()) {
        const Area* words = profile.find_area(std::string_view(area.view_of));
        const auto word = static_cast<std::uint16_t>(address / kBitsPerWord);
        if (words == nullptr || !words->readable.contains(word)) return {};
        return "  is bit " + std::to_string(address % kBitsPerWord) + " of " +
               format_notation(*words, word) + '\n';
    }
    for (const Area& bits : profile.areas) {
        const std::uint32_t first = address * kBitsPerWord;
        if (bits.view_of != area.name || !bits.readable.contains(first, kBitsPerWord)) continue;
        const AddressRange all{first, first + kBitsPerWord - 1};
        return "  its bits are " + range(bits, all) + '\n';
    }
    return {};
}

std::string details(const PanelProfile& profile, const Area& area, std::uint16_t address) {
    const bool writable = area.writable && area.writable->contains(address);
    std::string text = other_notations(profile, area, address);
    text += "  " + functions_of(profile, area.table, writable) + (writable ? "" : " (read only)") +
            '\n';
    for (const Table table : area.also) {
        text +=
            "  also " + place(table, address) + ": " + functions_of(profile, table, false) + '\n';
    }
    return text;
}

std::optional<std::uint32_t> number(std::string_view text) {
    const bool hex = text.size() > 2 && (text.substr(0, 2) == "0x" || text.substr(0, 2) == "0X");
    if (hex) text.remove_prefix(2);
    std::uint32_t value = 0;
    const char* end = text.data() + text.size();
    const auto [stop, error] =
        std::from_chars(text.data(), text.data() + text.size(), value, hex ? 16 : 10);
    if (text.empty() || error != std::errc() || stop != end || value > 0xFFFF) return std::nullopt;
    return value;
}

/// Parses "coil/288", "holding-registers 0x64" into table and address text; nullopt if no table is
/// named.
std::optional<std::pair<Table, std::string_view>> parse_address(std::string_view text) {
    const std::size_t cut = text.find_last_of("/ ");
    if (cut == std::string_view::npos) return std::nullopt;
    std::string table(text.substr(0, cut));
    std::replace(table.begin(), table.end(), '-', ' ');
    if (!table.empty() && table.back() == 's') table.pop_back();
    for (const auto& [known, name] : kSingular) {
        if (table == name) return std::pair(known, text.substr(cut + 1));
    }
    return std::nullopt;
}

std::string describe_function(const PanelProfile& profile, const FunctionRule& rule) {
    const unsigned most = profile.max_count(rule.code);
    std::string text = "  " + padded(std::to_string(rule.code), 3) +
                       padded(std::string(modbus::function_name(rule.code)), 30);
    if (most > 1) text += "up to " + std::to_string(most);
    if (rule.broadcast) text += most > 1 ? ", broadcast" : "broadcast";
    return text + cited(rule.source) + '\n';
}

std::string describe_area(const Area& area) {
    std::string text = "  " + padded(area.name, 8) + padded(singular(area.table), 17) +
                       padded("read " + range(area, area.readable), 30) +
                       (area.writable ? "write " + range(area, *area.writable) : "read only");
    for (const Table table : area.also) text += ", also " + singular(table);
    if (!area.view_of.empty()) text += ", bits of " + area.view_of;
    return text + cited(area.source) + '\n';
}

}  // namespace

std::string describe(const PanelProfile& profile) {
    const auto count = [](int value) { return std::to_string(value); };
    const auto parity = [](Parity p) { return to_string(p); };
    std::string text =
        profile.name + ": " + profile.description + "\nmanual: " + profile.manual + '\n';
    text +=
        "stations: " + count(profile.first_station) + " to " + count(profile.last_station) + '\n';
    text += "serial: baud " + listed(profile.serial.baud, count) + "; parity " +
            listed(profile.serial.parity, parity) + "; stop bits " +
            listed(profile.serial.stop_bits, count) +
            (profile.crc_order == modbus::CrcOrder::high_first ? "; CRC high byte first" : "") +
            cited(profile.serial.source) + '\n';
    char gap[16] = {};
    std::snprintf(gap, sizeof gap, "%.1f", profile.timing.frame_gap_characters);
    text += std::string("frame gap: ") + gap + " characters";
    if (profile.timing.max_gap_bits > 0)
        text += "; a pause of " + std::to_string(profile.timing.max_gap_bits) +
                " bit times inside a request loses it";
    text += cited(profile.timing.source) + '\n';
    text += "functions:\n";
    for (const FunctionRule& rule : profile.functions) text += describe_function(profile, rule);
    text += "areas:\n";
    for (const Area& area : profile.areas) text += describe_area(area);
    for (const Unreachable& hint : profile.unreachable)
        text += "  " + padded(hint.prefix, 8) + hint.reason + '\n';
    if (!profile.identification.empty()) text += "identified by:\n";
    for (const Identification& i : profile.identification) {
        text += "  " + to_hex(i.request) + " -> " + to_hex(i.reply) + " ...  " + i.means +
                (i.source.empty() ? "" : "  [" + i.source + ']') + '\n';
    }
    if (!profile.exceptions.empty()) text += "exceptions:\n";
    for (const ExceptionMeaning& e : profile.exceptions)
        text += "  " + padded(count(e.code), 3) + e.meaning + '\n';
    return text;
}

boost::system::result<std::string, NotationError> describe_address(const PanelProfile& profile,
                                                                   std::string_view what) {
    if (const auto named = parse_address(what)) {
        const auto& [table, text] = *named;
        const auto wanted = number(text);
        if (!wanted) {
            return NotationError{
                NotationError::Kind::malformed,
                '\'' + std::string(text) + "' is no address: 0 to 65535, or 0x0 to 0xFFFF"};
        }
        const auto address = static_cast<std::uint16_t>(*wanted);
        const Area* area = profile.find_area(table, address);
        if (area == nullptr) {
            return NotationError{NotationError::Kind::out_of_range,
                                 profile.name + " has no " + place(table, address)};
        }
        return place(table, address) + " -> " + format_notation(*area, address) + '\n' +
               details(profile, *area, address);
    }
    const auto item = parse_notation(profile, what);
    if (!item) return item.error();
    return format_notation(*item->area, item->address) + " -> " +
           place(item->area->table, item->address) + '\n' +
           details(profile, *item->area, item->address);
}

}  // namespace panelgate::profile
