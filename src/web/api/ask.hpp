#pragma once

#include <boost/asio/awaitable.hpp>
#include <memory>

#include "panelgate/bus/bus_client.hpp"
#include "panelgate/web/http/caller.hpp"

namespace panelgate::web {

/// One transaction, as one of the caller's: when it leaves, what still waits in a queue is never
/// transmitted. Throws boost::system::system_error(operation_aborted) when the caller has left
/// meanwhile: nobody is there to answer, and what the handler points to may be gone.
boost::asio::awaitable<bus::Answer> ask(std::shared_ptr<Caller> caller, bus::BusClient* bus,
                                        bus::Request request);

}  // namespace panelgate::web
