#pragma once

#include <boost/asio/awaitable.hpp>
#include <cstdint>
#include <memory>

#include "panelgate/base/bytes.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/web/http/caller.hpp"
#include "panelgate/web/http/problem.hpp"

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

}  // namespace panelgate::web
