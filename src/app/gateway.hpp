#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "panelgate/bus/bus.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/points/counters.hpp"
#include "panelgate/points/poller.hpp"
#include "panelgate/points/relays.hpp"
#include "panelgate/points/station_points.hpp"
#include "panelgate/sim/simulated_bus.hpp"
#include "panelgate/tcp_server/listener.hpp"
#include "panelgate/web/api/directory.hpp"
#include "panelgate/web/api/server.hpp"

namespace panelgate::app {

/// The composition root: builds the tree of objects of one configuration and owns it. One thread.
class Gateway {
  public:
    Gateway(boost::asio::any_io_executor executor, config::Config config, bool simulate);
    Gateway(const Gateway&) = delete;
    Gateway& operator=(const Gateway&) = delete;

    /// Opens lines and listeners. Throws std::system_error when a listener cannot be opened.
    void start();
    /// Stops accepting; what was accepted is answered within its deadline.
    void stop_accepting();
    /// Nothing is owed to any client any more.
    bool drained() const;
    /// Closes everything.
    void stop();

    std::uint16_t http_port() const { return http_ ? http_->port() : std::uint16_t{0}; }
    std::uint16_t modbus_port() const {
        return listeners_.empty() ? std::uint16_t{0} : listeners_[0]->port();
    }

  private:
    void add_line(const config::Line& line, bool simulate);
    void add_stations(const config::Line& line, bus::Bus& bus, sim::SimulatedBus* simulated);
    void add_listener(const tcp_server::Settings& settings);
    void add_http(const web::Settings& settings);
    void add_points(const config::Line& line, bus::Bus& bus);
    void add_relays();
    void publish_points(std::size_t first, const std::vector<std::size_t>& wants,
                        std::size_t station);
    std::vector<points::PointSample> point_samples() const;
    std::vector<points::RelaySample> relay_samples() const;
    std::string metrics_text() const;

    boost::asio::any_io_executor executor_;
    config::Config config_;
    web::EventHub events_;  ///< buses publish to it to their end
    std::vector<std::unique_ptr<sim::SimulatedBus>> simulated_;
    std::vector<std::unique_ptr<bus::Bus>> buses_;  ///< by the order of config_.lines
    std::vector<std::unique_ptr<points::Poller>> pollers_;
    std::deque<points::StationPoints> points_;  ///< referred to by the directory
    std::unique_ptr<points::Relays> relays_;
    std::vector<tcp_server::LineInfo> lines_;
    web::Directory directory_;
    std::vector<std::unique_ptr<tcp_server::Listener>> listeners_;
    std::unique_ptr<web::Server> http_;
    std::size_t open_listeners_ = 0;
    bool ready_ = false;
};

/// A simulated bus with the configured stations of a line.
std::unique_ptr<sim::SimulatedBus> simulate_line(boost::asio::any_io_executor executor,
                                                 const config::Line& line);

}  // namespace panelgate::app
