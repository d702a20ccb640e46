#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/json/object.hpp>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "key_book.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"
#include "station_path.hpp"

namespace panelgate::web {

/// What a write should leave in its panel, to compare with what is read back. Pure.
class Verification {
  public:
    /// Nothing unless the function is 05, 06, 0F, 10 or 16.
    static std::optional<Verification> of(const modbus::Request& write);

    /// The items that were written.
    const modbus::Span& span() const { return span_; }
    /// The same memory in a table that this panel can read; 422 if there is none.
    Parsed<modbus::Span> span_to_read(const profile::PanelProfile& panel) const;
    /// True if these items (bits as 0 and 1) match what was written.
    bool holds(std::span<const std::uint16_t> items) const;

  private:
    struct Cell {
        std::uint16_t value = 0;
        std::uint16_t mask = 0xFFFF;  ///< the bits that were written
    };

    modbus::Span span_;
    std::vector<Cell> cells_;
};

inline bool is_writable(modbus::Table table) {
    return table == modbus::Table::coils || table == modbus::Table::holding_registers;
}

/// The PDU that writes these cells from the first item on, with the first function of
/// write_functions() that the panel has; or why the panel cannot take them. Writes are never split.
Parsed<Bytes> plan_write(const Items& items, const std::vector<std::uint16_t>& cells);

/// The functions that can write `count` cells of a table, preferred first (one value by 05/06,
/// several by 0F/10). The table must be coils or holding registers.
std::vector<std::uint8_t> write_functions(modbus::Table table, std::size_t count);

/// The PDU that writes these cells (bits: 0 or 1) with this function: 05, 06, 0F or 10.
Bytes encode_write(std::uint8_t function, std::uint16_t address,
                   const std::vector<std::uint16_t>& cells);

/// The result of reading back a write.
struct ReadBack {
    std::optional<bool> holds{};         ///< nothing: the read failed
    std::vector<std::uint16_t> items{};  ///< what was read, if it differs
    std::string why{};                   ///< why the read failed
};
/// Adds "verified": true, false with "read_back", or null with "verify_detail".
void add_read_back(boost::json::object& result, const ReadBack& back);
/// Reads back the items of a write, in a table that the panel can read.
boost::asio::awaitable<ReadBack> read_back(std::shared_ptr<Caller> caller,
                                           const StationEntry* station, const Verification* written,
                                           Patience patience);

/// A client's write that may be sent.
struct Writing {
    StationEntry station;
    bus::Request request;
    std::optional<points::PointWrite> point{};   ///< set for a point: the answer has its value
    std::optional<Verification> verification{};  ///< set if the client wants it read back
};

/// Logs that a client's write was refused before any line was asked: by access, by the panel's
/// abilities or by a point's limits (403, 405, 409, 422). `at`: its target.
void log_refused(const Caller& caller, const std::string& at, const Problem& why);

/// Selects the table that can write the memory of a notation; 422 if it is read-only in this panel.
Parsed<Items> made_writable(Parsed<Items> items);
/// Plans a write of the body's "values" from the first item on, with its "verify". A lack of write
/// access is reported before any fault of the body.
Parsed<Writing> write_of(const Items& items, const Parsed<boost::json::object>& body);
/// The same for a point's "value".
Parsed<Writing> write_of(const PointOfStation& to, const Parsed<boost::json::object>& body,
                         const Parsed<points::Rounding>& rounding);

/// Sends the write. Returns {"transmitted","confirmed"} and the read-back. If the panel has not
/// answered, only reading back shows whether it took the write.
boost::asio::awaitable<Parsed<boost::json::object>> write(std::shared_ptr<Caller> caller,
                                                          const Writing* writing,
                                                          Patience patience);

}  // namespace panelgate::web
