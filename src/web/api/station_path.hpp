#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "panelgate/bus/bus_client.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/web/api/directory.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// The items of one station that a request addresses.
struct Items {
    StationEntry station;
    modbus::Span span;  ///< within the table
    std::uint16_t address() const { return static_cast<std::uint16_t>(span.first); }
    /// The memory area if a notation was used; then the profile's ranges apply.
    const profile::Area* area = nullptr;
};

Parsed<modbus::Table> parse_table(std::string_view word, unsigned status);
/// Parses an address, decimal or 0x hex, 0..65535.
Parsed<std::uint16_t> parse_address(std::string_view text);

Parsed<const LineEntry*> find_line(const Directory& directory, const std::string& name);
Parsed<StationEntry> find_station(const Directory& directory, const std::string& name);
struct PointOfStation {
    StationEntry station;
    const points::Point* point = nullptr;
};
Parsed<PointOfStation> find_point(const Directory& directory, const std::string& station,
                                  const std::string& point);
/// The same for "press/temperature".
Parsed<PointOfStation> find_point(const Directory& directory, const std::string& name);

/// One item of a table, or of the area that a notation names; then in the area's own table.
Parsed<Items> item_of_table(StationEntry station, modbus::Table table, std::uint16_t address);
Parsed<Items> item_of_notation(StationEntry station, std::string_view notation);

/// The items of /stations/{station}/{table}/{address}; their count is the query `count`.
Parsed<Items> items_of_table_path(const HttpRequest& request, const Directory& directory);
/// The same for /stations/{station}/devices/{notation}.
Parsed<Items> items_of_device_path(const HttpRequest& request, const Directory& directory);

/// Checks that these items lie in the area's range; else 422 that names the range. `what` is
/// "readable", …
Parsed<void> check_range(const Items& items, const profile::AddressRange& range,
                         std::string_view what);

/// The first table, the area's own or an alias of it, whose read function the panel has. Items of a
/// table path keep their table: the panel answers with an exception if it cannot read it.
Parsed<modbus::Table> table_to_read(const Items& items);

/// The problem for a request that the gateway refuses: 403 by access, 422 by a guard, 409 on a line
/// that only listens. Member "rule" is label(Rule).
Problem problem_of(const bus::Refusal& refusal);
/// 422 for what the profile rules out before a request is made: nothing was sent.
Problem ruled_out(bus::Rule rule, std::string detail);
/// Checks that the bus takes a write to this station, or (0) a broadcast; else 403 or 409.
Parsed<void> check_may_write(const bus::RequestPort& bus, std::uint8_t station);
/// Reports a lack of write access before any other problem of a planned write. A valid request
/// passes: the bus itself refuses, counts and logs it.
template <class T>
Parsed<T> unless_refused(Parsed<T> planned, const bus::RequestPort& bus, std::uint8_t station) {
    if (planned) return planned;
    if (const auto allowed = check_may_write(bus, station); !allowed) return allowed.error();
    return planned;
}

}  // namespace panelgate::web
