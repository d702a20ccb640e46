#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/json/object.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "panelgate/web/api/directory.hpp"
#include "panelgate/web/http/caller.hpp"
#include "panelgate/web/http/problem.hpp"
#include "patience.hpp"
#include "reading.hpp"
#include "station_path.hpp"
#include "view.hpp"

namespace panelgate::web {

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
