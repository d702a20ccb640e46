#pragma once

#include <cstdint>
#include <string>

#include "loader.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::config {

/// Warns of what is legal and does nothing: a limit of what nobody may write, an order of words
/// where there is only one.
void warn_of_idle_keys(Loading& loading, yaml::MapReader& in, const points::Point& point);

/// Raw numbers of a whole type, as far as 64 signed bits hold them.
struct RawRange {
    std::int64_t low = 0;
    std::int64_t high = 0;
    bool contains(std::int64_t raw) const { return raw >= low && raw <= high; }
    std::string text() const { return std::to_string(low) + " to " + std::to_string(high); }
};

/// Of labels; of a type that is not whole, everything.
RawRange label_range(points::Type type);
/// Of no_value: 65535 and -1 are the same register.
RawRange no_value_range(points::Type type);

/// The keys `min` and `max` of a point whose type, scale and offset are known: numbers that the
/// point can have.
void load_limits(yaml::MapReader& in, points::Point& point);

}  // namespace panelgate::config
