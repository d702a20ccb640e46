#pragma once

#include <boost/json/object.hpp>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/modbus/function.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/web/api/directory.hpp"
#include "panelgate/web/api/values.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// What a path or an entry of a list names: items of a station, perhaps those of a point.
struct Target {
    StationEntry station;
    modbus::Span span;  ///< within the table
    /// The memory area if a notation was used; then the ranges of the profile apply.
    const profile::Area* area = nullptr;
    const points::Point* point = nullptr;  ///< set if a point was named

    std::uint16_t address() const { return static_cast<std::uint16_t>(span.first); }
};

Parsed<const LineEntry*> find_line(const Directory& directory, const std::string& name);
Parsed<StationEntry> find_station(const Directory& directory, const std::string& name);
Parsed<Target> find_point(const Directory& directory, const std::string& station,
                          const std::string& point);
/// The same for "press/temperature".
Parsed<Target> find_point(const Directory& directory, const std::string& name);
/// `status`: of the problem where no table has this name.
Parsed<modbus::Table> parse_table(std::string_view word, unsigned status);

/// The items of /stations/{station}/{table}/{address}; their count is the query `count`.
Parsed<Target> table_target(const HttpRequest& request, const Directory& directory);
/// The same for /stations/{station}/devices/{notation}.
Parsed<Target> device_target(const HttpRequest& request, const Directory& directory);

/// The entries of {"items": [...]}: at least one object, at most `most`.
Parsed<std::vector<boost::json::object>> entries_of(std::string_view body, std::size_t most);
/// What an entry names: a point by {"point": "press/temperature"}, or one item by {"station",
/// "device"} or {"station", "table", "address"}. 400 for a member that is neither of these, nor
/// "id", nor among the given ones; "id" is the client's own, of any type.
Parsed<Target> entry_target(const boost::json::object& entry, const Directory& directory,
                            Members of_points, Members of_items);

/// Completes the items of a read: their count, and a table that the panel can read. The items of a
/// path of a table keep that table: the panel answers with an exception if it cannot read it. 400
/// or 422 for an impossible read, or one of more than `most` transactions.
Parsed<void> make_readable(Target& target, unsigned items, unsigned most);
/// Selects the table that can write the memory of a notation; 422 if it is read-only in this panel.
Parsed<Target> made_writable(Parsed<Target> target);
/// 422 if `count` items from the first one on reach beyond the table, or beyond what may be
/// written.
Parsed<void> check_written(const Target& target, std::size_t count);

inline bool is_writable(modbus::Table table) {
    return table == modbus::Table::coils || table == modbus::Table::holding_registers;
}

}  // namespace panelgate::web
