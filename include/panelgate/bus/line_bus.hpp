#pragma once

#include "panelgate/bus/bus_client.hpp"
#include "panelgate/bus/counters.hpp"

namespace panelgate::bus {

/// What the program starts, stops and counts: a line that is driven (Bus), or one that is only
/// listened to (ListeningBus).
class LineBus : public BusClient {
  public:
    virtual void start() = 0;
    /// Closes the line.
    virtual void stop() = 0;
    virtual LineReport report() const = 0;
};

}  // namespace panelgate::bus
