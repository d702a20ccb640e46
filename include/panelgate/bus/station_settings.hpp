#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/modbus/request.hpp"

namespace panelgate::bus {

/// The exception code that a request is answered with instead of being transmitted, or nothing.
using Guard = std::function<std::optional<std::uint8_t>(const modbus::Request&)>;

enum class Access : std::uint8_t { read_write, read_only };

/// What the configuration says of a station to its bus.
struct StationSettings {
    std::string name;
    Access access = Access::read_write;
    Guard guard{};  ///< empty: whatever is asked goes out
    /// What its panel is likely to be asked: counted from the start, with 0.
    std::vector<std::uint8_t> functions{};
};

/// Those that the configuration lists, by their ids.
using Stations = std::map<std::uint8_t, StationSettings>;

/// Its name, or its id when it is not listed.
std::string name_of(const Stations& stations, std::uint8_t id);

}  // namespace panelgate::bus
