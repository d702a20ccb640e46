#pragma once

#include <optional>

#include "panelgate/modbus/span.hpp"

namespace panelgate::modbus {

/// Could writing `written` change what a read of `items` gives? Other tables may show the same
/// memory (Autonics UB and UW), and a write without addresses (nothing) may change anything.
inline bool may_change(const std::optional<Span>& written, const Span& items) {
    return !written || written->table != items.table || written->overlaps(items);
}

}  // namespace panelgate::modbus
