#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "panelgate/bus/bus_client.hpp"

namespace panelgate::web {

/// A part of a line's trace, oldest first.
struct TracePage {
    std::vector<bus::TraceFrame> frames;
    std::vector<bus::TraceDecision> decisions;
    std::uint64_t next = 0;  ///< what follows this page: trace_since(next)
};

/// The last frames and the last decisions, at most `most` of each.
TracePage last_of_trace(const bus::BusClient& bus, std::size_t most);
/// The first that follow this number, frames and decisions together at most `most`. Where nothing
/// does, `next` is the newest there is, so that who asks on finds the way after a restart.
TracePage trace_since(const bus::BusClient& bus, std::uint64_t since, std::size_t most);

}  // namespace panelgate::web
