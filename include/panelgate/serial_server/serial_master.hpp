#pragma once

#include <memory>

#include "panelgate/line/line.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/serial_server/counters.hpp"
#include "panelgate/serial_server/settings.hpp"
#include "panelgate/tcp_server/dispatch.hpp"

namespace panelgate::serial_server {

/// A serial port on which somebody else is master: his requests go to the lines like those of any
/// other client, and the answers back to him as a slave's. One thread.
class SerialMaster {
  public:
    /// Units that no alias and no listed station has are not served. The clock and the buses in the
    /// map outlive it.
    SerialMaster(rt::Clock& clock, Settings settings, tcp_server::UnitMap units,
                 std::unique_ptr<line::Line> line);
    ~SerialMaster();  ///< as stop()
    SerialMaster(const SerialMaster&) = delete;
    SerialMaster& operator=(const SerialMaster&) = delete;

    void start();
    /// Takes nothing more; what was taken is answered.
    void finish();
    /// Nothing that was taken is without its answer.
    bool idle() const;
    /// Closes the device; what waits is taken back from the lines.
    void stop();
    Counters counters() const;

  private:
    class Core;
    std::shared_ptr<Core> core_;
};

}  // namespace panelgate::serial_server
