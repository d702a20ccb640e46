#pragma once

#include <boost/asio/awaitable.hpp>
#include <memory>
#include <set>
#include <string>

#include "panelgate/bus/bus_client.hpp"

namespace panelgate::web {

/// One HTTP session as the buses see it.
struct BusCaller {
    bus::ClientId client = bus::next_client_id();
    bus::Host host = 0;  ///< of the client's address; 0: unknown
    std::string name = "http";
    bool abandoned = false;
    std::set<bus::BusClient*> used;

    /// The session is over: what still waits in a queue is never transmitted.
    void abandon();
};

/// One transaction. Throws boost::system::system_error(operation_aborted) when the caller was
/// abandoned meanwhile: nobody is left to answer, and what the handler points to may be gone.
boost::asio::awaitable<bus::Answer> transact(std::shared_ptr<BusCaller> caller, bus::BusClient* bus,
                                             bus::Request request);

}  // namespace panelgate::web
