#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/points/point.hpp"

namespace panelgate::points {

inline constexpr Duration kSlowest = 24h;        ///< maximum of any interval
inline constexpr std::size_t kMaxPoints = 4096;  ///< per station
inline constexpr std::size_t kMaxPolls = 256;    ///< per station
inline constexpr std::size_t kMaxRelays = 256;
inline constexpr std::size_t kMaxLabels = 256;   ///< per point
inline constexpr std::size_t kMaxNoValues = 16;  ///< per point

/// A block that is polled without naming its points, to fill the `max_age` cache.
struct Poll {
    std::string read;  ///< the configured notation
    modbus::Table table = modbus::Table::holding_registers;
    std::uint16_t address = 0;
    std::uint32_t count = 1;
    Duration every = 1s;
    friend bool operator==(const Poll&, const Poll&) = default;
};

/// One endpoint of a relay.
struct RelayEnd {
    std::string station;  ///< its name
    std::string at;       ///< the notation
    modbus::Table table = modbus::Table::holding_registers;
    std::uint16_t address = 0;
    friend bool operator==(const RelayEnd&, const RelayEnd&) = default;
};

/// Copies a block from one station to another (the manuals' 1:1:N and N:1:N systems).
struct Relay {
    RelayEnd from;
    RelayEnd to;
    std::uint32_t count = 1;
    Duration every = 1s;
    bool on_change = false;  ///< write only if the values read differ from the last values written
    /// … and again this long after the last write: the target may have lost its memory.
    Duration refresh = 60s;

    /// Returns "press/UW100 to oven/GDT200".
    std::string name() const {
        return from.station + '/' + from.at + " to " + to.station + '/' + to.at;
    }
    friend bool operator==(const Relay&, const Relay&) = default;
};

}  // namespace panelgate::points
