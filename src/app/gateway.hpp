#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "discoveries.hpp"
#include "line_histories.hpp"
#include "northbound.hpp"
#include "openings.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/bus/line_bus.hpp"
#include "panelgate/bus/write_event.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/points/heard_values.hpp"
#include "panelgate/points/poller.hpp"
#include "panelgate/points/relays.hpp"
#include "panelgate/rt/asio_clock.hpp"
#include "panelgate/rt/loop_lag.hpp"
#include "panelgate/serial_server/serial_master.hpp"
#include "panelgate/sim/simulated_bus.hpp"
#include "panelgate/tap/heard.hpp"
#include "panelgate/tcp_server/listener.hpp"
#include "panelgate/web/api/directory.hpp"
#include "panelgate/web/api/server.hpp"
#include "panelgate/web/http/event_hub.hpp"
#include "plant.hpp"
#include "scrapes.hpp"
#include "showing.hpp"

namespace panelgate::app {

/// The composition root: builds the tree of objects of one configuration and owns it. One thread.
class Gateway {
  public:
    Gateway(boost::asio::any_io_executor executor, config::Config config, bool simulate);
    Gateway(const Gateway&) = delete;
    Gateway& operator=(const Gateway&) = delete;

    /// Opens lines and listeners. Throws CannotListen when a listener cannot be opened; one whose
    /// address is not there yet is opened later.
    void start();
    /// Stops accepting; what was accepted is answered within its deadline.
    void stop_accepting();
    /// Nothing is owed to any client any more.
    bool drained() const;
    /// Connections to whom something is owed, once nothing more is accepted.
    std::size_t owing() const;
    /// The longest that a request which was accepted may take to its answer.
    Duration longest_answer() const;
    /// Closes everything.
    void stop();

    std::uint16_t http_port() const { return http_ ? http_->port() : std::uint16_t{0}; }
    std::uint16_t modbus_port() const {
        return listeners_.empty() ? std::uint16_t{0} : listeners_[0]->port();
    }

  private:
    void on_bus_event(const std::string& line, const bus::BusEvent& event);
    void add_line(const config::Line& line, bool simulate);
    void add_points(const config::Line& line, bus::LineBus& bus);
    void add_poller(const config::Line& line, std::vector<points::PolledStation> polled,
                    bus::LineBus& bus);
    void add_heard(const config::Line& line, const std::vector<points::PolledStation>& polled);
    void hear(const std::string& line, const tap::Transaction& heard);
    void on_points(const std::string& line, std::uint8_t station,
                   const std::vector<std::size_t>& wants);
    void keep_histories();
    void add_relays();
    void add_listener(tcp_server::Settings settings);
    void add_serial_master(const serial_server::Settings& settings);
    void add_http(const web::Settings& settings);
    void add_doors();
    bool copy_figures(metrics::Snapshot& snapshot, PointCopy& points) const;

    boost::asio::any_io_executor executor_;
    rt::AsioClock clock_;
    rt::LoopLag lag_{clock_};
    config::Config config_;
    web::EventHub events_;  ///< buses publish to it to their end
    Plant plant_;           ///< what there is; everybody below is looked up in it, or shown by it
    /// Who hears of the writes on a line, by its name; buses tell to their end.
    std::map<std::string, std::function<void(const bus::WriteEvent&)>> write_listeners_;
    std::function<void(const std::string&, const bus::WriteEvent&)> relay_listener_;
    std::vector<std::unique_ptr<sim::SimulatedBus>> simulated_;
    std::vector<std::unique_ptr<bus::LineBus>> buses_;  ///< by the order of config_.lines
    std::unique_ptr<Discoveries> discoveries_;          ///< null without `http:`
    std::unique_ptr<LineHistories> line_histories_;     ///< null without `http:`
    std::vector<std::unique_ptr<points::Poller>> pollers_;
    /// Of lines that are only listened to, by their name and the station's id.
    std::map<std::pair<std::string, std::uint8_t>, points::HeardValues> heard_;
    std::unique_ptr<points::Relays> relays_;
    std::unique_ptr<Northbound> northbound_;  ///< null without `mqtt:`
    std::vector<std::unique_ptr<tcp_server::Listener>> listeners_;
    std::vector<std::unique_ptr<serial_server::SerialMaster>> serial_masters_;
    std::unique_ptr<Scrapes> scrapes_;
    web::Directory directory_;  ///< REST's view of the plant; empty without `http:`
    std::unique_ptr<web::Server> http_;
    Openings openings_{clock_};  ///< of the listeners and of HTTP
    std::size_t open_listeners_ = 0;
    bool ready_ = false;
};

}  // namespace panelgate::app
