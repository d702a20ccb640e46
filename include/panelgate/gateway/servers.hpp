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
#include "panelgate/gateway/plant.hpp"
#include "panelgate/metrics/exposition.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/serial_server/serial_master.hpp"
#include "panelgate/tcp_server/listener.hpp"
#include "panelgate/tls/context.hpp"
#include "panelgate/web/api/server.hpp"

namespace panelgate::gateway {

/// A listener to be opened.
struct ListenerHandle {
    std::string kind;  ///< its key in the configuration: "modbus_tcp", "http"
    std::string address;
    std::uint16_t port = 0;
    std::function<boost::system::error_code()> open;
    std::function<std::uint16_t()> opened_port;  ///< once it is open
    const void* owner = nullptr;                 ///< for forget()
};

/// A listener cannot be opened; the text includes advice.
struct CannotListen : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Opens the listeners. An address that the machine does not have yet (after a power cut the
/// network comes up late) is not fatal: it is retried until it exists. One thread; the clock
/// outlives it.
class Openings {
  public:
    static constexpr Duration kPause = 500ms;

    explicit Openings(rt::Clock& clock);

    /// Opens all of them in order. Throws CannotListen for errors that time alone does not fix;
    /// then earlier ones may be open, and none of these is retried.
    void open(const std::vector<ListenerHandle>& handles);
    /// Opens these as soon as possible: the former user of their address has just closed.
    void take_over(const std::vector<ListenerHandle>& handles);
    /// Forgets the owner's listeners.
    void forget(const void* owner);
    void stop();
    /// The listeners that are not open, and why, in words; empty: all are open.
    std::string missing() const;
    /// The open listeners: "modbus_tcp 127.0.0.1:502, http 127.0.0.1:8080".
    std::string listening() const;

  private:
    struct Waiting {
        ListenerHandle handle;
        boost::system::error_code why;
    };
    void try_again();
    void later();
    boost::system::error_code opened(const ListenerHandle& handle);

    rt::Clock& clock_;
    std::unique_ptr<rt::Alarm> again_;
    std::vector<Waiting> waiting_;
    std::vector<std::pair<const void*, std::string>> listening_;  ///< owner and address
};

/// Advice on a listener that cannot be opened; empty: none.
std::string listening_advice(const boost::system::error_code& why, std::uint16_t port);

/// All servers for clients: Modbus listeners, serial ports with a master, HTTP. A reload keeps
/// those that need not be reopened (is_same_listener()), with their connections. One thread.
class Servers {
  public:
    /// `stray` may be called as long as a connection lives.
    Servers(web::Loops loops, rt::Clock& clock, tcp_server::StrayWrite stray);

    /// What HTTP serves, created when first needed.
    struct Web {
        std::function<std::shared_ptr<const web::Directory>()> directory;
        std::function<web::Providers()> providers;
    };
    /// Opens what the configuration has and is not open yet; the rest stays unchanged. Throws
    /// CannotListen, and then nothing has changed. Until apply() new listeners use the lines of
    /// `plant`.
    void open(const config::Config& config, const Plant& plant, const Web& web);
    /// Call after open() with the same configuration: all serve it, and what it does not have is
    /// closed. `shown`: renders the configuration, in any thread. `longest`: longest time
    /// to an outstanding answer.
    void apply(const config::Config& config, const Plant& plant,
               const std::shared_ptr<const web::Directory>& directory,
               std::function<std::string()> shown, Duration longest);

    /// The files of the `tls` of a listener ("http 127.0.0.1:8443") have changed.
    void renew(const std::string& listener, const tls::Settings& settings);
    /// Closes the connections whose client's certificate has expired.
    void review();
    void stop_accepting(Duration longest);
    bool drained();
    std::size_t pending_connections() const;
    void close();
    /// As Openings::missing().
    std::string missing() const { return openings_.missing(); }
    /// As Openings::listening().
    std::string listening() const { return openings_.listening(); }
    void copy_figures(metrics::Snapshot& figures) const;
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
        std::unique_ptr<serial_server::SerialMaster> master;
    };

    tcp_server::Settings completed(tcp_server::Settings settings,
                                   const config::Config& config) const;
    Modbus make(const tcp_server::Settings& settings, const Plant& plant);
    Modbus* find(const tcp_server::Settings& settings);
    bool is_left_to(const ListenerHandle& handle, const config::Config& config) const;
    void open_new(const config::Config& config, const Plant& plant, const Web& web);
    void leave(Modbus modbus);
    void leave(Http http, Duration longest);
    void apply_masters(const config::Config& config, const Plant& plant);

    web::Loops loops_;
    rt::Clock& clock_;
    std::vector<Modbus> listeners_;  ///< in the order of the configuration
    std::optional<Http> http_;
    std::vector<Master> masters_;
    /// Made by open(), installed by apply(). A null listener: the open one is kept.
    struct Fresh {
        std::vector<Modbus> listeners;
        std::optional<Http> http;
        std::vector<ListenerHandle> late;  ///< whose address a closing listener still has
    } fresh_;
    /// Closing listeners, until their last answer is sent; never null.
    std::shared_ptr<std::list<Modbus>> leaving_ = std::make_shared<std::list<Modbus>>();
    std::vector<Http> leaving_http_;
    Openings openings_;
    tcp_server::StrayWrite stray_;
    std::size_t open_listeners_ = 0;
};

}  // namespace panelgate::gateway
