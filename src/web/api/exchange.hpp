#pragma once

#include <algorithm>
#include <boost/asio/associated_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/json/object.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/points/station_points.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"
#include "target.hpp"

namespace panelgate::web {

/// The time limit of a request over all its transactions: the deadline of its line (P3).
class Patience {
  public:
    /// `now` must outlive it.
    Patience(Duration deadline, const std::function<TimePoint()>& now)
        : now_(&now), end_(now() + deadline) {}

    /// Time left; zero if it is over.
    Duration left() const { return std::max(Duration::zero(), end_ - (*now_)()); }

  private:
    const std::function<TimePoint()>* now_;
    TimePoint end_;
};

/// Starts something with a callback and suspends the coroutine until `start` has called that with
/// the result, once. The coroutine resumes by post, so that what calls back is not entered again
/// from inside its own call.
template <class Result>
struct StartAndPost {
    template <class Handler>
    void operator()(Handler handler, std::function<void(std::function<void(Result)>)> start) const {
        auto shared = std::make_shared<Handler>(std::move(handler));
        start([shared](Result result) {
            const auto executor = boost::asio::get_associated_executor(*shared);
            boost::asio::post(executor, [shared, result = std::move(result)]() mutable {
                (std::move(*shared))(std::move(result));
            });
        });
    }
};
template <class Result>
boost::asio::awaitable<Result> result_of(std::function<void(std::function<void(Result)>)> start) {
    return boost::asio::async_initiate<const boost::asio::use_awaitable_t<>, void(Result)>(
        StartAndPost<Result>{}, boost::asio::use_awaitable, std::move(start));
}

/// Runs all of them concurrently on the awaiting coroutine's executor and resumes when the last has
/// ended. Then rethrows the first exception.
boost::asio::awaitable<void> gather(std::vector<boost::asio::awaitable<void>> all);

/// Registers the client's name with the bus until the client leaves.
void introduce(Caller& caller, bus::RequestPort* bus);
/// Runs one transaction for the caller, within its patience. When the caller leaves or hangs up, a
/// request that is still queued is never transmitted, and later ones are cancelled. Throws
/// boost::system::system_error(operation_aborted) if the caller has left meanwhile: there is no
/// client to answer, and what the handler points to may be gone.
boost::asio::awaitable<bus::Answer> ask(std::shared_ptr<Caller> caller, bus::RequestPort* bus,
                                        bus::Request request, Patience patience);

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
/// True if the bus would refuse this read: for a plan, because what is sent is judged by its bus,
/// and counted there.
bool is_refused_here(const Caller& caller, const StationEntry& station, const modbus::Span& span);

/// What a write should leave in its panel, to compare with what is read back. Pure.
class Verification {
  public:
    /// Nothing unless the function is 05, 06, 0F, 10 or 16.
    static std::optional<Verification> of(const modbus::Request& write);

    /// The written memory in a table that the panel can read; 422 without such a table.
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
/// Reads back what was written and adds to `result` "verified": true, false with "read_back", or
/// null with "verify_detail". Returns whether the items match.
boost::asio::awaitable<bool> read_back(std::shared_ptr<Caller> caller, const StationEntry* station,
                                       const Verification* written, Patience patience,
                                       boost::json::object* result);

/// The functions that can write `count` cells of a table, preferred first (one value by 05/06,
/// several by 0F/10). The table must be coils or holding registers.
std::vector<std::uint8_t> write_functions(modbus::Table table, std::size_t count);
/// The PDU that writes the cells (bits: 0 or 1) with function 05, 06, 0F or 10.
Bytes encode_write(std::uint8_t function, std::uint16_t address,
                   const std::vector<std::uint16_t>& cells);

/// A client's write that may be sent.
struct Writing {
    StationEntry station;
    bus::Request request;
    std::optional<points::PointWrite> point{};   ///< set for a point: the answer has its value
    std::optional<Verification> verification{};  ///< set if the client wants it read back
};
/// Plans the one write that the body asks for, with its "verify": of a point by "value", of items
/// by "values" from the first item on. A lack of write access is reported before any fault of the
/// body. `rounding`: of a point's value.
Parsed<Writing> write_of(const Target& to, const Parsed<boost::json::object>& body,
                         const Parsed<points::Rounding>& rounding = points::Rounding::exact);
/// Sends the write. Returns {"transmitted","confirmed"} and the read-back. If the panel has not
/// answered, only reading back shows whether it took the write.
boost::asio::awaitable<Parsed<boost::json::object>> write(std::shared_ptr<Caller> caller,
                                                          const Writing* writing,
                                                          Patience patience);
/// Logs that a client's write was refused before any line was asked: by access, by the panel's
/// abilities or by a point's limits (403, 405, 409, 422). `at`: its target.
void log_refused(const Caller& caller, const std::string& at, const Problem& why);

}  // namespace panelgate::web
