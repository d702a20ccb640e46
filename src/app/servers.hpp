#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "openings.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/metrics/exposition.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/serial_server/serial_master.hpp"
#include "panelgate/tcp_server/listener.hpp"
#include "panelgate/web/api/server.hpp"
#include "plant.hpp"

namespace panelgate::app {

/// All whom clients ask: listeners for Modbus, serial ports with a master, HTTP. A reload keeps
/// those whose door is the same, with their connections. One thread.
class Servers {
  public:
    Servers(boost::asio::any_io_executor executor, rt::Clock& clock);

    /// What HTTP serves; made when it is needed first.
    struct Web {
        std::function<std::shared_ptr<const web::Directory>()> directory;
        std::function<web::Providers()> providers;
    };
    /// Opens what the configuration has and is not open yet; the rest stays as it is. Throws
    /// CannotListen, and then nothing has changed. Until apply() they ask the lines of `plant`.
    void open(const config::Config& config, const Plant& plant, const Web& web);
    /// Behind open() of the same: all serve this, and what it does not have is closed. `longest`:
    /// of an answer that is owed.
    void apply(const config::Config& config, const Plant& plant,
               const std::shared_ptr<const web::Directory>& directory, const web::SharedText& shown,
               Duration longest);

    void stop_accepting(Duration longest);
    bool drained();
    std::size_t owing() const;
    void close();
    /// Those that do not stand, in words.
    std::string missing() const { return openings_.missing(); }
    /// Those that stand.
    std::string standing() const { return openings_.standing(); }
    void copy_figures(metrics::Snapshot& snapshot) const;
    std::uint16_t http_port() const { return http_ ? http_->server->port() : std::uint16_t{0}; }
    std::uint16_t modbus_port() const {
        return listeners_.empty() ? std::uint16_t{0} : listeners_[0].listener->port();
    }

  private:
    struct Modbus {
        tcp_server::Settings settings;
        std::unique_ptr<tcp_server::Listener> listener;
    };
    struct Http {
        web::Settings settings;
        std::unique_ptr<web::Server> server;
    };
    struct Master {
        serial_server::Settings settings;
        std::vector<tcp_server::LineInfo> lines;  ///< that it may ask
        std::unique_ptr<serial_server::SerialMaster> master;
    };

    tcp_server::Settings completed(tcp_server::Settings settings,
                                   const config::Config& config) const;
    Modbus make(const tcp_server::Settings& settings, const Plant& plant);
    Modbus* find(const tcp_server::Settings& settings);
    bool is_left_to(const Door& door, const config::Config& config) const;
    void open_new(const config::Config& config, const Plant& plant, const Web& web);
    void leave(Modbus modbus);
    void leave(Http http, Duration longest);
    void apply_masters(const config::Config& config, const Plant& plant);

    boost::asio::any_io_executor executor_;
    rt::Clock& clock_;
    std::vector<Modbus> listeners_;  ///< by the order of the configuration
    std::optional<Http> http_;
    std::vector<Master> masters_;
    /// Made by open(), and put in by apply(): null where the one that stands stays.
    struct Fresh {
        std::vector<Modbus> listeners;
        std::optional<Http> http;
        std::vector<Door> late;  ///< whose address somebody has who is going to leave
    } fresh_;
    /// Until their last answer is out; never null.
    std::shared_ptr<std::list<Modbus>> leaving_ = std::make_shared<std::list<Modbus>>();
    std::vector<Http> leaving_http_;
    Openings openings_;
    std::size_t open_listeners_ = 0;
};

}  // namespace panelgate::app
