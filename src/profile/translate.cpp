#include "panelgate/profile/translate.hpp"

#include <algorithm>
#include <array>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/translation.hpp"

namespace panelgate::profile {
namespace {

using modbus::Table;

/// Some memory, all of these items in one area, is shown through both tables.
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

}  // namespace panelgate::profile
