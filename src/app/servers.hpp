#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/system/error_code.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/metrics/exposition.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/serial_server/serial_master.hpp"
#include "panelgate/tcp_server/listener.hpp"
#include "panelgate/web/api/server.hpp"
#include "plant.hpp"

namespace panelgate::app {

/// A listener that is to be opened.
struct Door {
    std::string kind;  ///< as the configuration calls it: "modbus_tcp", "http"
    std::string address;
    std::uint16_t port = 0;
    std::function<boost::system::error_code()> open;
    std::function<std::uint16_t()> opened_port;  ///< once it is open
    const void* whose = nullptr;                 ///< for forget()
};

/// A listener that cannot be opened; its text says what helps.
struct CannotListen : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Opens the listeners. An address that the machine does not have yet (after a power cut the
/// network comes late) is no reason to give up: it is tried again until it is there. One thread;
/// the clock outlives it.
class Openings {
  public:
    static constexpr Duration kPause = 500ms;

    explicit Openings(rt::Clock& clock);

    /// Opens all of them, in their order. Throws CannotListen for what time alone does not mend;
    /// then those before it may be open, and nothing more is tried for any of these.
    void open(const std::vector<Door>& doors);
    /// Opens these as soon as it is possible: whoever held their address has just left.
    void take_over(const std::vector<Door>& doors);
    /// Not any more.
    void forget(const void* whose);
    void stop();
    /// Those that do not stand, and why, in words; empty: all stand.
    std::string missing() const;
    /// Those that stand: "modbus_tcp 127.0.0.1:502, http 127.0.0.1:8080".
    std::string standing() const;

  private:
    struct Waiting {
        Door door;
        boost::system::error_code why;
    };
    void try_again();
    void later();
    boost::system::error_code opened(const Door& door);

    rt::Clock& clock_;
    std::unique_ptr<rt::Alarm> again_;
    std::vector<Waiting> waiting_;
    std::vector<std::pair<const void*, std::string>> standing_;  ///< whose, and where
};

/// What somebody can do about a listener that cannot be opened; empty: nothing is known.
std::string listening_advice(const boost::system::error_code& why, std::uint16_t port);

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
