#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/json/object.hpp>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/bus/bus_client.hpp"
#include "panelgate/points/value.hpp"
#include "panelgate/web/http/caller.hpp"
#include "panelgate/web/http/problem.hpp"
#include "patience.hpp"
#include "station_path.hpp"
#include "verification.hpp"

namespace panelgate::web {

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
