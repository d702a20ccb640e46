#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "panelgate/rt/clock.hpp"
#include "panelgate/tcp_server/counters.hpp"
#include "panelgate/tcp_server/dispatch.hpp"
#include "panelgate/tcp_server/settings.hpp"

namespace boost::asio {
class any_io_executor;
}

namespace panelgate::tcp_server {

/// One port for Modbus over TCP (README, Modbus/TCP), in the framing of its settings, and its
/// connections; with settings.udp also for datagrams. One thread: everything runs on the
/// executor given. The clock and the buses in the map outlive it; answers that come after its end
/// are dropped.
class Listener {
  public:
    /// `version`: of the program, for the device identification. Throws std::invalid_argument for
    /// an allow list that cannot be read.
    Listener(const boost::asio::any_io_executor& executor, rt::Clock& clock, Settings settings,
             UnitMap units, std::string version);
    ~Listener();  ///< as close_now()
    Listener(const Listener&) = delete;
    Listener& operator=(const Listener&) = delete;

    /// Binds and accepts. Throws std::system_error with the address in its text when it cannot.
    void start();
    /// Serves by these from the next request on; whoever may not be connected any more is cut off.
    /// Only with settings.is_same_door(). Throws as the constructor does, and then nothing has
    /// changed.
    void apply(Settings settings, UnitMap units);
    /// The port it is bound to; 0 before start().
    std::uint16_t port() const;
    Counters counters() const;

    /// No new connections or requests; what is outstanding is answered, then each connection is
    /// closed. `done` is called once, later, when none is left (also after close_now()).
    void stop(std::function<void()> done);
    /// Cuts every connection; requests that wait are taken back from their buses.
    void close_now();

  private:
    class Core;
    std::shared_ptr<Core> core_;
};

}  // namespace panelgate::tcp_server
