#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/config/config.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/rt/asio_clock.hpp"
#include "panelgate/sim/simulated_bus.hpp"
#include "panelgate/web/api/directory.hpp"
#include "panelgate/web/api/server.hpp"
#include "panelgate/web/http/event_hub.hpp"
#include "pty_link.hpp"
#include "tcp_bridge.hpp"

namespace panelgate::app {

/// What a link begins with that is no path.
inline constexpr std::string_view kTcpLink = "tcp://";

/// The panels of all lines, the ways to them, and to their faults. One thread.
class SimulatedPanels {
  public:
    explicit SimulatedPanels(boost::asio::any_io_executor executor);

    /// `link`: a path that is to lead to the line's pty, tcp://ADDR:PORT, or empty. Throws
    /// std::system_error.
    void add(const config::Line& line, const std::string& link);
    /// GET and PUT /api/v1/simulator/{station} there, for everybody; after all lines. Throws
    /// std::system_error.
    void serve_faults(const config::Endpoint& endpoint);
    /// Where each line is reached and who is on it, for a person to read.
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
    web::Directory directory_;  ///< of stations that have faults, and no bus
    std::unique_ptr<web::Server> http_;
    std::string text_;
};

}  // namespace panelgate::app
