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

/// What REST asks of a station (0: of all of a line), or why it may not be transmitted.
Parsed<bus::Request> request_to(std::uint8_t station, Bytes pdu);

/// One transaction, as one of the caller's: when it leaves or hangs up, what still waits in a queue
/// is never transmitted, and what it asks for after that is cancelled. Throws
/// boost::system::system_error(operation_aborted) when the caller has left meanwhile: nobody is
/// there to answer, and what the handler points to may be gone.
boost::asio::awaitable<bus::Answer> ask(std::shared_ptr<Caller> caller, bus::BusClient* bus,
                                        bus::Request request);

/// Tells the bus who asks, for as long as the client is there.
void introduce(Caller& caller, bus::BusClient* bus);

/// How a client wants values told, in its own words: queries, or members of an entry of a list.
struct Wording {
    std::optional<std::string> type;   ///< as points have it
    std::optional<std::string> order;  ///< ABCD…
    std::optional<unsigned> length;    ///< characters of a string
    unsigned count = 1;                ///< values
    bool raw = false;
};
inline constexpr unsigned kMaxText = 240;  ///< characters of a string

/// From the queries type, order, length and raw.
Parsed<Wording> wording_of(const HttpRequest& request);
/// From the members of these names, and count.
Parsed<Wording> wording_of(const boost::json::object& entry);

/// How the items of a read are understood. Made of a wording and a table, so that both agree.
struct View {
    points::Point value;  ///< what each value is: its type, order and length
    unsigned items = 1;   ///< of the table, of all values
    bool raw = false;     ///< the items themselves are shown, too
};
/// 400 for a type or an order that nobody knows, or that a table of bits does not have.
Parsed<View> view_of(const Wording& wording, modbus::Table table);

/// The values in these items (bits as 0 and 1), as many as view.items: null where there is none.
boost::json::array values_of(const View& view, std::span<const std::uint16_t> items);

/// Items as they were read.
struct Reading {
    std::vector<std::uint16_t> items;  ///< bits as 0 and 1
    unsigned transactions = 0;
    Duration age{};  ///< of the oldest
    bool cached = false;

    /// A normal reply that has all items of this span.
    void take(const bus::Answer& answer, const modbus::Span& span);
};

/// Reads all of it, in as many transactions as the panel needs, one after the other; or why not all
/// of it could be read before its time was over.
boost::asio::awaitable<Parsed<Reading>> read_all(std::shared_ptr<Caller> caller,
                                                 const StationEntry* station, modbus::Span span,
                                                 Patience patience);

/// The items that such a read begins with, as many as it wants and by a table that the panel can
/// read them by; and how they are told. 400 and 422 for what cannot be.
Parsed<View> prepare_read(Items& items, const Wording& wording, unsigned max_transactions);

/// {"station","table","address","notation","values",["raw"],"age_ms","source",["transactions"]}
boost::json::object describe(const Items& items, const View& view, const Reading& reading);

/// One of many reads: what is asked for, and what came of it.
struct BatchRead {
    boost::json::object item;  ///< as it was asked
    Items items;
    View view;
    std::optional<PointOfStation> point{};  ///< whose value it is
    std::optional<Problem> problem{};       ///< why it was not, or cannot be, read
    Reading reading{};                      ///< filled as its pieces come
};

/// Reads those of one line, station by station, in as few requests as their panels' profiles allow,
/// one after the other. A read that the panel refuses is halved until what it does not have stands
/// alone, so that nobody fails with a neighbour. `transactions` is counted up.
boost::asio::awaitable<void> read_line(std::shared_ptr<Caller> caller, const LineEntry* line,
                                       std::vector<BatchRead*> entries, Patience patience,
                                       unsigned* transactions);

}  // namespace panelgate::web
