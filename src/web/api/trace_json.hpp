#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/json/object.hpp>

#include "long_answer.hpp"
#include "panelgate/bus/trace.hpp"

namespace panelgate::web {

/// What a line remembers, as JSON says it. Instants are seconds of the gateway's monotonic clock;
/// `time` is by the clock on the wall.
boost::json::object describe(const bus::TraceFrame& frame);
boost::json::object describe(const bus::TraceDecision& decision);
boost::json::object describe(const bus::TraceTransaction& transaction);
boost::json::object describe(const bus::IncidentHead& incident);

/// Its three lists, as members. Both outlive it: whoever asks waits for it, and others have their
/// turn meanwhile.
boost::asio::awaitable<void> add_part(LongAnswer* body, const bus::TracePart* part);

}  // namespace panelgate::web
