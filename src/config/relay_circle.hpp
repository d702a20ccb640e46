#pragma once

#include <cstddef>
#include <vector>

#include "panelgate/config/config.hpp"
#include "panelgate/modbus/span.hpp"

namespace panelgate::config {

/// Where items really are, in bits: a panel may show the same memory as words and as bits.
struct Memory {
    const Station* station = nullptr;
    modbus::Span bits;

    bool overlaps(const Memory& other) const {
        return station == other.station && bits.overlaps(other.bits);
    }
};

/// What a relay does: item for item, in the same order. Both are of the same length.
struct Copy {
    Memory from;
    Memory to;
};

/// The last of `copies` and those that bring an item of its source back to where it was, in that
/// order; empty when no item ever comes back. Without the last there must be no circle; no two
/// targets overlap.
std::vector<std::size_t> find_circle(const std::vector<Copy>& copies);

}  // namespace panelgate::config
