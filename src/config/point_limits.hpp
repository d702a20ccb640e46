#pragma once

#include <cstdint>
#include <string>

#include "loader.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::config {

/// Warns of keys without effect: limits of a point that is not writable, a word order for a single
/// word.
void warn_of_unused_keys(Loading& loading, yaml::MapReader& in, const points::Point& point);

/// Raw numbers of an integer type, as far as a signed 64-bit integer holds them.
struct RawRange {
    std::int64_t low = 0;
    std::int64_t high = 0;
    bool contains(std::int64_t raw) const { return raw >= low && raw <= high; }
    std::string text() const { return std::to_string(low) + " to " + std::to_string(high); }
};

/// Range for labels; unlimited for other than integer types.
RawRange label_range(points::Type type);
/// Range for no_value: 65535 and -1 are the same register.
RawRange no_value_range(points::Type type);

/// Reads the keys `min` and `max` of a point whose type, scale and offset are known; both must be
/// values that the point can have.
void load_limits(yaml::MapReader& in, points::Point& point);

}  // namespace panelgate::config
