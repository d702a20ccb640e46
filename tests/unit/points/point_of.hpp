#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "panelgate/base/decimal.hpp"
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

inline Point scaled(Type type, double scale, double offset = 0) {
    Point point = point_of(type);
    point.scale = scale;
    point.offset = offset;
    return point;
}

/// A point of this type with raw values that mean "no value".
inline Point without(Type type, std::vector<std::int64_t> no_value, double scale = 1) {
    Point point = scaled(type, scale);
    point.no_value = std::move(no_value);
    return point;
}

inline Point limited(Point point, std::optional<Decimal> min, std::optional<Decimal> max) {
    point.min = std::move(min);
    point.max = std::move(max);
    return point;
}

inline Point text_of(unsigned length) {
    Point point = point_of(Type::string);
    point.length = length;
    return point;
}

/// A bit of the first register.
inline Point bit_of(unsigned bit) {
    Point point = point_of(Type::boolean);
    point.bit = bit;
    return point;
}

}  // namespace panelgate::points
