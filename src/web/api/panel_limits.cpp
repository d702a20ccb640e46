#include "panel_limits.hpp"

#include <string>

#include "panelgate/profile/notation.hpp"
#include "refusal.hpp"

namespace panelgate::web {

Parsed<void> check_range(const Items& items, const profile::AddressRange& range,
                         std::string_view what) {
    if (range.contains(items.span.first, items.span.count)) return {};
    const auto first =
        profile::format_notation(*items.area, static_cast<std::uint16_t>(range.first));
    const auto last = profile::format_notation(*items.area, static_cast<std::uint16_t>(range.last));
    return ruled_out(bus::Rule::range,
                     std::to_string(items.span.count) + " from " + items.area->name + " address " +
                         std::to_string(items.span.first) + " is outside what is " +
                         std::string(what) + ": " + first + " to " + last);
}

Parsed<modbus::Table> table_to_read(const Items& items) {
    if (items.area == nullptr ||
        items.station.profile->has_function(read_function(items.span.table))) {
        return items.span.table;
    }
    for (const modbus::Table table : items.area->also) {
        if (items.station.profile->has_function(read_function(table))) return table;
    }
    return ruled_out(bus::Rule::function,
                     "the panel has no function that reads " + items.area->name);
}

}  // namespace panelgate::web
