#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/config/config.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/rt/acceptor.hpp"
#include "panelgate/rt/asio_clock.hpp"
#include "panelgate/sim/simulated_bus.hpp"
#include "panelgate/web/api/directory.hpp"
#include "panelgate/web/api/server.hpp"
#include "panelgate/web/http/event_hub.hpp"

namespace panelgate::gateway {

/// A symbolic link to a pty, there for as long as the object lives. An existing link is replaced in
/// one step; anything else in its place is left alone and an error.
class PtyLink {
  public:
    /// Throws std::system_error.
    PtyLink(std::string link, const std::string& target);
    ~PtyLink();
    PtyLink(const PtyLink&) = delete;
    PtyLink& operator=(const PtyLink&) = delete;

  private:
    std::string link_;
    std::string target_;
};

/// Serves a pty like a serial device server: RTU frames over TCP, one client at a time; a new
/// client replaces the old one. One thread.
class TcpBridge {
  public:
    /// Listens. Throws std::system_error.
    TcpBridge(const boost::asio::any_io_executor& executor, const config::Endpoint& endpoint,
              const std::string& device);
    ~TcpBridge();
    TcpBridge(const TcpBridge&) = delete;
    TcpBridge& operator=(const TcpBridge&) = delete;

    std::uint16_t port() const;

  private:
    struct State;
    std::shared_ptr<State> state_;
    rt::Acceptor acceptor_;
};

/// The prefix of a link that is not a path.
inline constexpr std::string_view kTcpLink = "tcp://";

/// The simulated panels of all lines, their links, and REST access to their faults. One thread.
class SimulatedPanels {
  public:
    explicit SimulatedPanels(boost::asio::any_io_executor executor);

    /// `link`: a path to become a link to the line's pty, tcp://ADDR:PORT, or empty. Throws
    /// std::system_error.
    void add(const config::Line& line, const std::string& link);
    /// Serves GET and PUT /api/v1/simulator/{station} at the endpoint, for all clients; call after
    /// all lines are added. Throws std::system_error.
    void serve_faults(const config::Endpoint& endpoint);
    /// Where each line is reached and its stations, for the user.
    const std::string& text() const { return text_; }
    void stop();

  private:
    /// "/tmp/press -> /dev/pts/3"
    std::string lead_to(const std::string& line, const std::string& device,
                        const std::string& link);

    boost::asio::any_io_executor executor_;
    rt::AsioClock clock_;
    std::vector<std::shared_ptr<sim::SimulatedBus>> buses_;
    std::vector<std::unique_ptr<PtyLink>> links_;
    std::vector<std::unique_ptr<TcpBridge>> bridges_;
    web::EventHub nothing_happens_;
    web::Directory directory_;  ///< stations with faults, without a bus
    std::unique_ptr<web::Server> http_;
    std::string text_;
};

}  // namespace panelgate::gateway
