#pragma once

#include <memory>

#include "panelgate/line/line.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/serial_server/counters.hpp"
#include "panelgate/serial_server/settings.hpp"
#include "panelgate/tcp_server/dispatch.hpp"

namespace panelgate::serial_server {

/// A serial port with an external master: its requests are forwarded to the lines like any other
/// client's, and it gets the answers as from a slave. Single-threaded.
class SerialMaster {
  public:
    /// Serves only units with an alias or a configured station. The clock and the buses in the map
    /// must outlive it.
    SerialMaster(rt::Clock& clock, Settings settings, tcp_server::UnitMap units,
                 std::unique_ptr<line::Line> line);
    ~SerialMaster();  ///< as stop()
    SerialMaster(const SerialMaster&) = delete;
    SerialMaster& operator=(const SerialMaster&) = delete;

    void start();
    /// Requires settings.is_same_port(). A request in progress gets its answer as before.
    void apply(Settings settings, tcp_server::UnitMap units);
    /// Accepts no further requests; accepted ones are still answered.
    void finish();
    /// True if no accepted request is outstanding.
    bool idle() const;
    /// Closes the device and cancels queued requests on the lines.
    void stop();
    Counters counters() const;

  private:
    class Core;
    std::shared_ptr<Core> core_;
};

}  // namespace panelgate::serial_server
