#pragma once

#include <cstdint>
#include <vector>

#include "panelgate/points/point.hpp"

namespace panelgate::points {

using Words = std::vector<std::uint16_t>;

/// Returns a writable point "x" at the first register; a text has six characters.
inline Point point_of(Type type, WordOrder order = WordOrder::abcd) {
    Point point;
    point.name = "x";
    point.at = "D0";
    point.type = type;
    point.word_order = order;
    point.writable = true;
    if (type == Type::string) point.length = 6;
    return point;
}

}  // namespace panelgate::points
