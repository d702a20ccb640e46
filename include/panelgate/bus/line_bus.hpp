#pragma once

#include <memory>

#include "panelgate/bus/bus_client.hpp"
#include "panelgate/bus/counters.hpp"

namespace panelgate::line {
class Line;
}

namespace panelgate::bus {

struct Settings;

/// What the program starts, stops and counts: a line that is driven (Bus), or one that is only
/// listened to (ListeningBus).
class LineBus : public BusClient {
  public:
    virtual void start() = 0;
    /// Closes the line.
    virtual void stop() = 0;
    /// Goes on with these. What is owed, counted, recorded and known stays, but for stations that
    /// are no longer listed. `line` takes the place of the one before as soon as that waits for no
    /// reply; meanwhile and until it is open requests wait for their turn. `far_end` is kept until
    /// the one before is closed. Null, the same line goes on: only where is_same_wire().
    virtual void apply(Settings settings, std::unique_ptr<line::Line> line,
                       std::shared_ptr<void> far_end) = 0;
    /// From when on nothing that was asked on its wire can still be answered there (P1).
    virtual TimePoint clear_at() const { return {}; }
    /// Nothing is asked before then.
    virtual void rest_until(TimePoint until) { static_cast<void>(until); }
    virtual LineReport report() const = 0;
};

}  // namespace panelgate::bus
