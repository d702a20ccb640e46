#pragma once

#include <cstddef>
#include <cstdint>

#include "panelgate/bus/bus_client.hpp"
#include "panelgate/bus/trace.hpp"

namespace panelgate::web {

struct TracePage {
    bus::TracePart part;
    std::uint64_t next = 0;  ///< what follows this page: trace_since(next)
};

/// The last frames, decisions and transactions, at most `most` of each.
TracePage last_of_trace(const bus::BusClient& bus, std::size_t most);
/// The first that follow this number, all of them together at most `most`; a transaction's number
/// is that of its end. Where nothing does, `next` is the newest there is, so that who asks on finds
/// the way after a restart.
TracePage trace_since(const bus::BusClient& bus, std::uint64_t since, std::size_t most);

}  // namespace panelgate::web
