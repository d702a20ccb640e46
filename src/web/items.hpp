#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "api.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/function.hpp"

namespace panelgate::web {

/// Items of one station that a request names.
struct Items {
    StationEntry station;
    modbus::Table table = modbus::Table::holding_registers;
    std::uint16_t address = 0;  ///< 0-based, as on the wire
    unsigned count = 1;         ///< address + count is at most 65536
    /// The piece of memory, when a notation named it; then the profile's ranges hold.
    const profile::Area* area = nullptr;
};

Parsed<modbus::Table> parse_table(std::string_view word, unsigned status);
/// Decimal or 0x hex, 0..65535.
Parsed<std::uint16_t> parse_address(std::string_view text);
/// A query value as a whole number in [low, high]; `fallback` when it is not given.
Parsed<unsigned> query_number(const HttpRequest& request, const std::string& name, unsigned low,
                              unsigned high, unsigned fallback);

Parsed<const LineEntry*> find_line(const Api& api, const std::string& name);
Parsed<StationEntry> find_station(const Api& api, const std::string& name);
/// From /stations/{station}/{table}/{address}.
Parsed<Items> items_of_table_path(const HttpRequest& request, const Api& api);
/// From /stations/{station}/devices/{notation}; table is the area's own.
Parsed<Items> items_of_device_path(const HttpRequest& request, const Api& api);

/// Items in one request with this function: the panel's limit, or the standard's.
unsigned max_count(const StationEntry& station, std::uint8_t function);
bool has_function(const StationEntry& station, std::uint8_t function);
/// May [address, address + count) be used? 422 that names the range. `what` is "readable", …
Parsed<void> check_range(const Items& items, const profile::AddressRange& range,
                         std::string_view what);
/// The panel manual's word for an exception code, or "".
std::string meaning_of(const profile::PanelProfile& profile, std::uint8_t code);
/// "1F 01 FF"
std::string upper_hex(ByteView bytes, std::string_view separator = " ");

}  // namespace panelgate::web
