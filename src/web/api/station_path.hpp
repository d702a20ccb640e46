#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/span.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/web/api/directory.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// Items of one station that a request names.
struct Items {
    StationEntry station;
    modbus::Span span;  ///< none beyond the end of the table
    std::uint16_t address() const { return static_cast<std::uint16_t>(span.first); }
    /// The piece of memory, when a notation named it; then the profile's ranges hold.
    const profile::Area* area = nullptr;
};

Parsed<modbus::Table> parse_table(std::string_view word, unsigned status);
/// Decimal or 0x hex, 0..65535.
Parsed<std::uint16_t> parse_address(std::string_view text);

Parsed<const LineEntry*> find_line(const Directory& directory, const std::string& name);
Parsed<StationEntry> find_station(const Directory& directory, const std::string& name);
struct PointOfStation {
    StationEntry station;
    const points::Point* point = nullptr;
};
Parsed<PointOfStation> find_point(const Directory& directory, const std::string& station,
                                  const std::string& point);
/// The same by "press/temperature".
Parsed<PointOfStation> find_point(const Directory& directory, const std::string& name);

/// One item of a table, or of the memory that a notation names; its table is the area's own.
Parsed<Items> item_of_table(StationEntry station, modbus::Table table, std::uint16_t address);
Parsed<Items> item_of_notation(StationEntry station, std::string_view notation);

/// From /stations/{station}/{table}/{address}; the query `count` says how many.
Parsed<Items> items_of_table_path(const HttpRequest& request, const Directory& directory);
/// The same from /stations/{station}/devices/{notation}.
Parsed<Items> items_of_device_path(const HttpRequest& request, const Directory& directory);

}  // namespace panelgate::web
