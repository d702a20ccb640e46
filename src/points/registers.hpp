#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "panelgate/points/point.hpp"

namespace panelgate::points {

// Between a point's registers and its raw number; what decode and encode share.

using Words = std::vector<std::uint16_t>;

/// Into the standard's order, or out of it: it is its own inverse.
Words reordered(std::span<const std::uint16_t> items, WordOrder order, bool keep_words);
/// The first word is the highest.
std::uint64_t joined(const Words& words);
Words parted(std::uint64_t raw, unsigned count);

/// Nothing for digits that are no BCD.
std::optional<std::int64_t> from_bcd(std::uint64_t raw, unsigned digits);
std::uint64_t to_bcd(std::uint64_t value);

inline bool is_bcd(Type type) { return type == Type::bcd16 || type == Type::bcd32; }
/// Neither scaled nor moved.
inline bool is_plain(const Point& point) { return point.scale == 1 && point.offset == 0; }
/// The value of this raw number.
double from_raw(const Point& point, double raw);

/// This raw number says that there is no value. As many low bits count as the type has: -1 and
/// 65535 are the same u16.
bool means_none(const Point& point, std::uint64_t number);
bool means_none(const Point& point, double number);

}  // namespace panelgate::points
