#include "panelgate/profile/panel_profile.hpp"

#include <algorithm>
#include <chrono>

namespace panelgate::profile {

namespace {

/// Returns the maximum items per request of the Application Protocol (AP 6.1 to 6.17).
unsigned standard_limit(std::uint8_t function) {
    switch (function) {
        case modbus::kReadCoils:
        case modbus::kReadDiscreteInputs:
            return 2000;
        case modbus::kReadHoldingRegisters:
        case modbus::kReadInputRegisters:
        case modbus::kReadWriteMultipleRegisters:
            return 125;
        case modbus::kWriteMultipleCoils:
            return 1968;
        case modbus::kWriteMultipleRegisters:
            return 123;
        default:
            return 1;
    }
}

}  // namespace

const FunctionRule* PanelProfile::find_function(std::uint8_t code) const {
    const auto found = std::find_if(functions.begin(), functions.end(),
                                    [&](const FunctionRule& rule) { return rule.code == code; });
    return found == functions.end() ? nullptr : &*found;
}

const Area* PanelProfile::find_area(std::string_view wanted) const {
    const auto found = std::find_if(areas.begin(), areas.end(),
                                    [&](const Area& area) { return area.name == wanted; });
    return found == areas.end() ? nullptr : &*found;
}

const Area* PanelProfile::find_area(modbus::Table table, std::uint32_t address) const {
    const auto found = std::find_if(areas.begin(), areas.end(), [&](const Area& area) {
        return area.reaches(table) && area.readable.contains(address);
    });
    return found == areas.end() ? nullptr : &*found;
}

unsigned PanelProfile::max_count(std::uint8_t function) const {
    const FunctionRule* rule = find_function(function);
    return rule != nullptr && rule->max_count > 0 ? rule->max_count : standard_limit(function);
}

Duration asked_gap(const SerialFormat& serial, const PanelProfile& profile) {
    if (serial.mode == SerialMode::ascii) return {};
    const double characters = profile.timing.frame_gap_characters;
    return std::chrono::duration_cast<Duration>(characters * character_time(serial));
}

Duration automatic_gap(const SerialFormat& serial, const PanelProfile& profile) {
    return std::max(silent_interval(serial), asked_gap(serial, profile));
}

}  // namespace panelgate::profile
