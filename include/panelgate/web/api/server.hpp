#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/system/error_code.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/points/relays.hpp"
#include "panelgate/web/api/directory.hpp"
#include "panelgate/web/api/sources.hpp"
#include "panelgate/web/http/counters.hpp"
#include "panelgate/web/http/crossing.hpp"
#include "panelgate/web/http/event_hub.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/settings.hpp"

namespace panelgate::store {
class Database;
}  // namespace panelgate::store
namespace panelgate::tls {
struct Settings;
}  // namespace panelgate::tls
namespace panelgate::web {

/// Limits of one request, and of the remembered writes with an Idempotency-Key.
struct ApiSettings {
    /// Per read: that many full ones take about 10 s at 19200 baud.
    unsigned max_transactions = 64;
    std::size_t max_items = 256;     ///< entries of one list
    std::size_t max_values = 32768;  ///< registers and bits of all its entries
    Duration keys_kept = 10min;      ///< how long the result of a write with a key is remembered
    std::size_t max_keys = 4096;     ///< of finished and running writes together
    std::size_t max_kept = 8 * 1024 * 1024;  ///< bytes of remembered answers
    std::size_t gzip_from =
        1400;  ///< bytes of a body; a smaller one fits one packet and is not packed
};

class AlarmSource;
class DiscoverySource;
class HttpListener;
class KeyBook;
class ReloadSource;
class TextSource;
struct Site;

/// What the server shows besides the directory. All functions but now() and wall() are called from
/// the plant's loop.
struct Providers {
    /// Copies all figures; the function returned makes the text of /metrics of them, in any thread.
    std::function<std::function<std::string()>()> figures;
    std::string metrics_type;              ///< the content type of that text
    std::function<bool()> ready;           ///< configuration applied and all listeners open
    std::function<std::string()> missing;  ///< what is not open yet, in words
    std::string version;
    std::string commit;                            ///< the commit that it was built from
    std::string compiler;                          ///< "clang 19.1.7"
    std::map<std::string, std::string> libraries;  ///< name to version
    std::function<TimePoint()> now;                ///< the machine's monotonic clock, any thread
    std::function<WallTime()> wall;                ///< the current wall-clock time, any thread
    std::function<std::vector<points::RelayStatus>()> relays;
    std::function<std::vector<Finding>()> findings{};  ///< of the gateway; empty: it looks for none
    std::function<StandbyView()> standby{};            ///< empty: there is no other box
    std::function<std::vector<LineUsage>()> usage{};   ///< of each line; empty: none is counted
    /// Of the faces' loop, before a scrape: takes counters of other faces along to the plant's
    /// loop, where the function returned is called. Both may be empty.
    std::function<std::function<void()>()> collect{};
    EventHub* events = nullptr;            ///< of the faces' loop; never null; outlives the server
    DiscoverySource* discovery = nullptr;  ///< null only without lines; outlives the server
    AlarmSource* alarms = nullptr;         ///< null: there are no alarms; outlives the server
    ReloadSource* reload = nullptr;        ///< null: reload is not available; outlives the server
    TextSource* text = nullptr;            ///< null: there is no text; outlives the server
    /// Renders the active configuration, a JSON object without secrets, in any thread; null: not
    /// shown.
    std::function<std::string()> configuration;
    /// Told of what clients change or are refused, for an audit; may be empty.
    std::function<void(const Deed&)> record{};
    /// Runs `read` in the store's thread, with nullptr if nothing can be read, then `done` in the
    /// plant's loop. Empty: there is no store.
    std::function<void(std::function<void(const store::Database*)> read,
                       std::function<void()> done)>
        ask_store{};
    /// Hands what is known of a point, "STATION/POINT", to the store, before a read.
    std::function<void(const std::string&)> write_history{};
    ApiSettings settings{};
};

/// What is served: the gateway, or only simulated panels, whose directory may have no buses.
enum class Surface : std::uint8_t { gateway, simulator };

/// HTTP/1.1 server: probes, metrics and the REST API. An object of the plant's loop, whose listener
/// lives in that of the faces.
class Server {
  public:
    Server(Loops loops, Settings settings, std::shared_ptr<const Directory> directory,
           Providers providers, Surface surface = Surface::gateway);
    /// Closes everything at once, unlike stop(); outstanding answers are not sent.
    ~Server();
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    /// Opens the listener. On an error (address in use, invalid address…) nothing is open.
    boost::system::error_code start();
    /// Serves these from the next request on, see HttpListener::apply(). Running requests keep the
    /// settings and the directory that they started with.
    void apply(Settings settings, std::shared_ptr<const Directory> directory,
               std::function<std::string()> configuration);
    /// The port that it listens on; 0 before start().
    std::uint16_t port() const { return port_; }
    /// Closes the listener and idle connections; running requests are answered, then their
    /// connections are closed. A client has at most `reading` to read its answer.
    void stop(Duration reading = 10s);
    /// Number of open connections; falls to 0 after stop().
    std::size_t connections() const;
    /// As HttpListener::renew().
    void renew(const tls::Settings& settings);
    /// As HttpListener::review().
    void review();
    /// The counters as they were when /metrics was asked for last.
    Counters counters() const;

  private:
    using Current = std::shared_ptr<const Directory>;

    std::shared_ptr<const Site> site_of(Settings settings,
                                        std::shared_ptr<const Directory> directory) const;

    std::shared_ptr<Crossing> crossing_;
    Providers providers_;
    Surface surface_;
    std::shared_ptr<KeyBook> keys_;
    std::shared_ptr<Counters> figures_ = std::make_shared<Counters>();
    std::uint16_t port_ = 0;
    // Of the faces' loop:
    /// The directory that is served, also for streams that began with an earlier one.
    std::shared_ptr<Current> current_;
    std::shared_ptr<HttpListener> listener_;
};

}  // namespace panelgate::web
