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

/// May these items of an area be used? 422 that names the range. `what` is "readable", …
Parsed<void> check_range(const Items& items, const profile::AddressRange& range,
                         std::string_view what);

/// The first table, the area's own or another that reaches it, whose read function the panel has.
/// A table path is taken at its word: what the panel makes of it, its exception tells.
Parsed<modbus::Table> table_to_read(const Items& items);

/// What a client is told of a request that is refused here: 403 by access, 422 by a guard. The
/// member "rule" is label(Rule).
Problem problem_of(const bus::Refusal& refusal);
/// 422 of what the profile rules out before it is a request: nothing was sent.
Problem ruled_out(bus::Rule rule, std::string detail);
/// Would the bus take a write to this station, or (0) to everybody on its line? 403 when it would
/// not.
Parsed<void> check_may_write(const bus::BusClient& bus, std::uint8_t station);
/// What has become of a write to this station before it is asked: where nobody may write, that is
/// told before anything else that is wrong. One that nothing is wrong with is the bus's to refuse,
/// which counts and tells it.
template <class T>
Parsed<T> unless_refused(Parsed<T> planned, const bus::BusClient& bus, std::uint8_t station) {
    if (planned) return planned;
    if (const auto allowed = check_may_write(bus, station); !allowed) return allowed.error();
    return planned;
}

}  // namespace panelgate::web
