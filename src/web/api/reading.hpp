#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "key_book.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/web/api/directory.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"
#include "station_path.hpp"

namespace panelgate::web {

/// The bus request to a station (0: broadcast), or why it may not be transmitted.
Parsed<bus::Request> request_to(std::uint8_t station, Bytes pdu);

/// Runs one transaction for the caller. When the caller leaves or hangs up, a request that is still
/// queued is never transmitted, and later ones are cancelled. Throws
/// boost::system::system_error(operation_aborted) if the caller has left meanwhile: there is no
/// client to answer, and what the handler points to may be gone.
boost::asio::awaitable<bus::Answer> ask(std::shared_ptr<Caller> caller, bus::RequestPort* bus,
                                        bus::Request request);

/// Registers the client's name with the bus until the client leaves.
void introduce(Caller& caller, bus::RequestPort* bus);

/// How a client wants values rendered, as given: from queries, or from the members of a list entry.
struct ValueFormat {
    std::optional<std::string> type;   ///< a point's type
    std::optional<std::string> order;  ///< ABCD…
    std::optional<unsigned> length;    ///< characters of a string
    unsigned count = 1;                ///< values
    bool raw = false;
};
inline constexpr unsigned kMaxText = 240;  ///< characters of a string

/// Reads the queries type, order, length and raw.
Parsed<ValueFormat> format_of(const HttpRequest& request);
/// Reads the members of these names, and count.
Parsed<ValueFormat> format_of(const boost::json::object& entry);

/// How the items of a read are interpreted, checked against their table.
struct View {
    points::Point value;  ///< type, order and length of each value
    unsigned items = 1;   ///< items of all values together
    bool raw = false;     ///< show the raw items, too
};
/// 400 for a type or an order that is unknown or not possible for a table of bits.
Parsed<View> view_of(const ValueFormat& format, modbus::Table table);

/// The values in these items (bits as 0 and 1); null for an item range that has no value.
boost::json::array values_of(const View& view, std::span<const std::uint16_t> items);

/// The items that were read.
struct Reading {
    std::vector<std::uint16_t> items;  ///< bits as 0 and 1
    unsigned transactions = 0;
    Duration age{};  ///< age of the oldest item
    bool cached = false;

    /// Appends the items of a normal reply that covers this span.
    void take(const bus::Answer& answer, const modbus::Span& span);
};

/// Reads the whole span, in as many consecutive transactions as the panel needs; or returns why not
/// all of it could be read in time.
boost::asio::awaitable<Parsed<Reading>> read_all(std::shared_ptr<Caller> caller,
                                                 const StationEntry* station, modbus::Span span,
                                                 Patience patience);

/// Completes the items of a read: their count, and a table that the panel can read. Returns how to
/// render them; 400 or 422 for an impossible read.
Parsed<View> prepare_read(Items& items, const ValueFormat& format, unsigned max_transactions);

/// {"station","table","address","notation","values",["raw"],"age_ms","source",["transactions"]}
boost::json::object describe(const Items& items, const View& view, const Reading& reading);

/// One read of a list, and its result.
struct BatchRead {
    boost::json::object item;  ///< the entry as sent
    Items items;
    View view;
    std::optional<PointOfStation> point{};  ///< set if the entry names a point
    std::optional<Problem> problem{};       ///< why it failed
    Reading reading{};                      ///< filled piece by piece
};

/// Reads the entries of one line, station by station, in as few consecutive requests as the panels'
/// profiles allow. A read that a panel refuses is bisected until only the missing items fail, so
/// that no entry fails because of its neighbour. `transactions` is incremented.
boost::asio::awaitable<void> read_line(std::shared_ptr<Caller> caller, const LineEntry* line,
                                       std::vector<BatchRead*> entries, Patience patience,
                                       unsigned* transactions);

}  // namespace panelgate::web
