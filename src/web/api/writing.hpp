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
#include "panelgate/points/value.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"
#include "station_path.hpp"

namespace panelgate::web {

/// What a write leaves in its panel, to be held against what is read there afterwards. Pure.
class Verification {
  public:
    /// Nothing for what is not 05, 06, 0F, 10 or 16.
    static std::optional<Verification> of(const modbus::Request& write);

    /// The items that were written.
    const modbus::Span& span() const { return span_; }
    /// The same memory by a table that this panel can read it by; 422 when there is none.
    Parsed<modbus::Span> span_to_read(const profile::PanelProfile& panel) const;
    /// Do these items (bits as 0 and 1) hold what was written?
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

/// The PDU that writes these cells from the first of the items on, by the first of the functions
/// below that the panel has; or why the panel cannot take them. Writes are never split.
Parsed<Bytes> plan_write(const Items& items, const std::vector<std::uint16_t>& cells);

/// Functions that can write `count` cells of a table, the preferred one first (one value by 05/06,
/// several by one 0F/10). The table must be coils or holding registers.
std::vector<std::uint8_t> write_functions(modbus::Table table, std::size_t count);

/// The PDU that writes these cells, each 16 bits wide (bits: 0 or 1), with this function: 05, 06,
/// 0F or 10.
Bytes encode_write(std::uint8_t function, std::uint16_t address,
                   const std::vector<std::uint16_t>& cells);

/// What was read where a write has been.
struct ReadBack {
    std::optional<bool> holds{};         ///< nothing: it could not be read
    std::vector<std::uint16_t> items{};  ///< of what does not hold
    std::string why{};                   ///< it could not be read
};
/// Adds "verified": true, false with "read_back", or null with "verify_detail".
void tell(boost::json::object& told, const ReadBack& back);
/// Reads the items of a write back, by a table that the panel can read them by.
boost::asio::awaitable<ReadBack> read_back(std::shared_ptr<Caller> caller,
                                           const StationEntry* station, const Verification* written,
                                           Patience patience);

/// One write of a client that can go out, and what is told of it.
struct Writing {
    StationEntry station;
    bus::Request request;
    std::optional<points::PointWrite> point{};   ///< its value is told
    std::optional<Verification> verification{};  ///< its client wants it read back
};

/// Says in the log that a client's write was refused before any line was asked: by rights, by what
/// its panel is, by a point's limits (403, 405, 409, 422). `at`: what it was to write.
void log_refused(const Caller& caller, const std::string& at, const Problem& why);

/// The table that writes the memory of a notation; 422 where the panel lets nobody write it.
Parsed<Items> made_writable(Parsed<Items> items);
/// "values" of the body from the first of these items on; "verify". Where nobody may write, that is
/// told before anything that is wrong with the body.
Parsed<Writing> write_of(const Items& items, const Parsed<boost::json::object>& body);
/// The same of a point's "value".
Parsed<Writing> write_of(const PointOfStation& to, const Parsed<boost::json::object>& body,
                         const Parsed<points::Rounding>& rounding);

/// What is told of it when it is over: {"transmitted","confirmed"} and what was read back. Where
/// its panel has not answered, reading back tells what nobody else can.
boost::asio::awaitable<Parsed<boost::json::object>> write(std::shared_ptr<Caller> caller,
                                                          const Writing* writing,
                                                          Patience patience);

}  // namespace panelgate::web
