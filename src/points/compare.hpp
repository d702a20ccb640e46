#pragma once

#include "panelgate/points/value.hpp"

namespace panelgate::points {

// A value beside a double, without making a double of the value: beyond 2^53 that would be another
// number. Of numbers only; a bit is 0 or 1.

bool is_below(const Value& value, double bound);
bool is_above(const Value& value, double bound);
bool is_same(const Value& value, double other);
/// The shortest digits that mean this float are those of the value: 1e23, that no double is.
bool is_printed_as(const Value& value, double number);
bool is_printed_as(const Value& value, float number);

}  // namespace panelgate::points
