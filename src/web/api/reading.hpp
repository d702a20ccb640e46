#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/json/object.hpp>
#include <cstdint>
#include <memory>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/modbus/span.hpp"
#include "panelgate/web/http/caller.hpp"
#include "panelgate/web/http/problem.hpp"
#include "patience.hpp"
#include "station_path.hpp"
#include "view.hpp"

namespace panelgate::web {

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

}  // namespace panelgate::web
