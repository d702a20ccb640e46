#pragma once

#include <algorithm>
#include <cstdint>

#include "panelgate/modbus/function.hpp"

namespace panelgate::modbus {

inline constexpr std::uint32_t kTableItems = 65536;  ///< of each table (AP 4.3)

/// Items [first, end()) of one table, 0-based as on the wire. Whether they are there, end() within
/// kTableItems, is asked where it matters.
struct Span {
    Table table = Table::holding_registers;
    std::uint32_t first = 0;
    std::uint32_t count = 1;

    std::uint32_t end() const { return first + count; }  ///< one past the last item
    bool contains(const Span& other) const {
        return table == other.table && first <= other.first && other.end() <= end();
    }
    bool overlaps(const Span& other) const {
        return table == other.table && first < other.end() && other.first < end();
    }
    /// They overlap or lie side by side: together they are one span without a hole.
    bool touches(const Span& other) const {
        return table == other.table && other.first <= end() && first <= other.end();
    }
    friend bool operator==(const Span&, const Span&) = default;
};

/// The least span that contains both, which are of one table.
inline Span join(const Span& a, const Span& b) {
    const std::uint32_t first = std::min(a.first, b.first);
    return {a.table, first, std::max(a.end(), b.end()) - first};
}

}  // namespace panelgate::modbus
