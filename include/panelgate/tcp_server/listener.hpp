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

/// A Modbus over TCP listener (docs/connect/modbus-tcp.md) on one port, in the framing of its
/// settings, with its connections; settings.udp adds datagrams. Single-threaded: everything runs on
/// the given executor. The clock and the buses in the map must outlive it; answers that arrive
/// after its end are dropped.
class Listener {
  public:
    /// `version` is the program's, for the device identification. `stray` may be empty. Throws
    /// std::invalid_argument for an unreadable allow list.
    Listener(const boost::asio::any_io_executor& executor, rt::Clock& clock, Settings settings,
             UnitMap units, std::string version, StrayWrite stray = {});
    ~Listener();  ///< as close_now()
    Listener(const Listener&) = delete;
    Listener& operator=(const Listener&) = delete;

    /// Binds and starts to accept. Throws std::system_error, with the address in its text, on
    /// failure.
    void start();
    /// Applies new settings from the next request on; closes connections no longer allowed.
    /// Requires settings.is_same_listener(). Throws like the constructor, and then leaves
    /// everything unchanged.
    void apply(Settings settings, UnitMap units);
    /// Takes the same `tls` with changed files, for connections to come; closes those whose
    /// certificate is revoked now. Ignored without TLS.
    void renew(const tls::Settings& settings);
    /// Closes connections whose certificate is revoked or has expired. Ignored without TLS.
    void review();
    /// Returns the bound port; 0 before start().
    std::uint16_t port() const;
    Counters counters() const;

    /// Stops accepting connections and requests; answers outstanding requests, then closes each
    /// connection. `done` is called once, asynchronously, when no connection is left (also after
    /// close_now()).
    void stop(std::function<void()> done);
    /// Closes every connection at once; cancels requests still queued on the buses.
    void close_now();

  private:
    class Core;
    std::shared_ptr<Core> core_;
};

/// Returns a human-readable register map of the gateway's own unit, ending with a newline.
std::string describe_register_map();

}  // namespace panelgate::tcp_server
