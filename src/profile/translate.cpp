#include "panelgate/profile/translate.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::profile {

namespace {

using modbus::Table;

/// True if one area contains all these items and is shown in both tables.
bool is_same_memory(const PanelProfile& profile, const modbus::Span& items, Table other) {
    return std::ranges::any_of(profile.areas, [&](const Area& area) {
        return area.reaches(items.table) && area.reaches(other) &&
               area.readable.contains(items.first, items.count);
    });
}

bool share_memory(const PanelProfile& profile, Table a, Table b) {
    return std::ranges::any_of(
        profile.areas, [&](const Area& area) { return area.reaches(a) && area.reaches(b); });
}

}  // namespace

std::vector<Translation> translations(const PanelProfile& profile) {
    using namespace modbus;
    constexpr std::array<Translation, 4> kAll{{{kReadDiscreteInputs, kReadCoils},
                                               {kReadInputRegisters, kReadHoldingRegisters},
                                               {kWriteSingleCoil, kWriteMultipleCoils},
                                               {kWriteSingleRegister, kWriteMultipleRegisters}}};
    const bool bits = share_memory(profile, Table::discrete_inputs, Table::coils);
    const bool words = share_memory(profile, Table::input_registers, Table::holding_registers);
    std::vector<Translation> possible;
    for (const Translation& one : kAll) {
        if (profile.has_function(one.asked) || !profile.has_function(one.sent)) continue;
        const bool read = modbus::is_read(one.asked);
        const bool shared = one.asked == kReadDiscreteInputs ? bits : words;
        if (!read || shared) possible.push_back(one);
    }
    return possible;
}

std::optional<modbus::Request> translate(const PanelProfile& profile,
                                         const modbus::Request& request) {
    if (profile.has_function(request.function())) return std::nullopt;
    auto other = modbus::translated(request);
    if (!other || !profile.has_function(other->function())) return std::nullopt;
    const auto& asked = request.span();
    const auto& sent = other->span();
    if (request.is_read() && !(asked && sent && is_same_memory(profile, *asked, sent->table)))
        return std::nullopt;
    return other;
}

namespace {

/// Returns the items that lie in the area, through any of its tables.
std::optional<modbus::Span> intersection(const Area& area, const modbus::Span& items) {
    if (!area.reaches(items.table)) return std::nullopt;
    const std::uint32_t first = std::max(items.first, area.readable.first);
    const std::uint32_t end = std::min(items.end(), area.readable.last + 1);
    if (first >= end) return std::nullopt;
    return modbus::Span{area.table, first, end - first};
}

void add_in_all_tables(const Area& area, modbus::Span items, std::vector<modbus::Span>& shown) {
    shown.push_back(items);
    for (const modbus::Table table : area.also) {
        items.table = table;
        shown.push_back(items);
    }
}

void add_bits_of(const PanelProfile& profile, const Area& words, const modbus::Span& items,
                 std::vector<modbus::Span>& shown) {
    for (const Area& bits : profile.areas) {
        if (bits.view_of != words.name) continue;
        add_in_all_tables(
            bits, {bits.table, items.first * kBitsPerWord, items.count * kBitsPerWord}, shown);
    }
}

}  // namespace

std::vector<modbus::Span> shown_as(const PanelProfile& profile, const modbus::Span& written) {
    std::vector<modbus::Span> shown{written};
    for (const Area& area : profile.areas) {
        const auto items = intersection(area, written);
        if (!items) continue;
        add_in_all_tables(area, *items, shown);
        add_bits_of(profile, area, *items, shown);
        if (area.view_of.empty()) continue;
        const Area& words = *profile.find_area(std::string_view(area.view_of));
        const std::uint32_t first = items->first / kBitsPerWord;
        const std::uint32_t last = (items->end() - 1) / kBitsPerWord;
        const modbus::Span viewed{words.table, first, last - first + 1};
        add_in_all_tables(words, viewed, shown);
        add_bits_of(profile, words, viewed, shown);
    }
    return shown;
}

}  // namespace panelgate::profile
