#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "discoveries.hpp"
#include "northbound.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/metrics/exposition.hpp"
#include "panelgate/points/relays.hpp"
#include "panelgate/rt/asio_clock.hpp"
#include "panelgate/rt/process.hpp"
#include "panelgate/web/api/server.hpp"
#include "panelgate/web/http/event_hub.hpp"
#include "running_line.hpp"
#include "scene.hpp"
#include "scrapes.hpp"
#include "servers.hpp"

namespace panelgate::app {

class Reloader;

/// The composition root: what is made of a configuration, and what becomes of it when there is
/// another one. One thread.
class Gateway {
  public:
    /// `reloads`: who is asked by REST to read the file again; null: nobody. It outlives this.
    Gateway(boost::asio::any_io_executor executor, std::shared_ptr<const config::Config> config,
            bool simulate, Reloader* reloads);
    Gateway(const Gateway&) = delete;
    Gateway& operator=(const Gateway&) = delete;

    /// Opens lines and listeners. Throws CannotListen when a listener cannot be opened; one whose
    /// address is not there yet is opened later.
    void start();
    /// Serves this from now on; lines, listeners, clients and points that are the same do not
    /// notice. Throws CannotListen, or std::system_error without a pty for a simulated line; then
    /// nothing has changed. `shown`: its text for REST. Stations that are the same panels share
    /// their profile with those that run (config::share_profiles()).
    void apply(std::shared_ptr<const config::Config> config, web::SharedText shown);
    const std::shared_ptr<const config::Config>& config() const { return scene_->config; }
    /// Stops accepting; what was accepted is answered within its deadline.
    void stop_accepting();
    /// Nothing is owed to any client any more, and the broker knows that this is the end.
    bool drained();
    /// Connections to whom something is owed, once nothing more is accepted.
    std::size_t owing() const { return servers_.owing(); }
    /// The longest that a request which was accepted may take to its answer.
    Duration longest_answer() const;
    /// In words, for who has started the program.
    std::string status() const;
    /// Closes everything.
    void stop();

    std::uint16_t http_port() const { return servers_.http_port(); }
    std::uint16_t modbus_port() const { return servers_.modbus_port(); }

  private:
    using Lines = std::vector<std::shared_ptr<RunningLine>>;

    LineWatch watch();
    void on_event(const std::string& line, const bus::BusEvent& event);
    void on_points(const std::string& line, std::uint8_t station,
                   const std::vector<std::size_t>& wants);
    Lines lines_of(const config::Config& config);
    void apply_lines(const config::Config& config, const Lines& lines);
    void rest_wires(const config::Config& config, const Lines& lines);
    void retire_lines(const Lines& lines);
    void show(const std::shared_ptr<Scene>& scene);
    web::Providers providers();
    bool copy_figures(metrics::Snapshot& snapshot, PointCopy& points, const Scene& scene) const;

    boost::asio::any_io_executor executor_;
    rt::AsioClock clock_;
    rt::LoopLag lag_{clock_};
    bool simulate_;
    Reloader* reloads_;
    web::EventHub events_;  ///< buses publish to it to their end
    /// Never null; what is there to be looked up, or shown.
    std::shared_ptr<Scene> scene_;
    std::function<void(const std::string&, const bus::WriteEvent&)> relay_listener_;
    /// Those of earlier configurations too, closed: whoever still knows one gets an answer, and it
    /// is taken up again under its name. By name and mode.
    /// Requests that were cut off may keep a scene, and so its lines, for longer than this lives.
    struct KnownLines {
        ~KnownLines();
        std::map<std::pair<std::string, bool>, std::shared_ptr<RunningLine>> lines;
    } known_;
    std::unique_ptr<Discoveries> discoveries_;       ///< null until there is `http:`
    std::unique_ptr<LineHistories> line_histories_;  ///< the same
    std::unique_ptr<points::Relays> relays_;
    std::unique_ptr<Scrapes> scrapes_;  ///< null until there is `http:`
    Servers servers_;
    Northbound northbound_;
    bool ready_ = false;
};

}  // namespace panelgate::app
