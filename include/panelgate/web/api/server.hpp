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
#include "panelgate/web/api/settings.hpp"
#include "panelgate/web/api/sources.hpp"
#include "panelgate/web/http/counters.hpp"
#include "panelgate/web/http/event_hub.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/settings.hpp"

namespace panelgate::web {

class DiscoverySource;
class HttpListener;
class KeyBook;
class ReloadSource;
struct Site;

/// What the server shows besides the directory. The functions are called in the one thread.
struct Providers {
    MetricsSource* metrics = nullptr;      ///< never null; outlives the server
    std::string metrics_type;              ///< the content type of its text
    std::function<bool()> ready;           ///< do configuration and listeners stand?
    std::function<std::string()> missing;  ///< what does not stand yet, in words
    std::string version;
    std::string commit;                            ///< it was built from
    std::string compiler;                          ///< "clang 19.1.7"
    std::map<std::string, std::string> libraries;  ///< by name, their versions
    std::function<TimePoint()> now;                ///< the machine's monotonic clock
    std::function<WallTime()> wall;                ///< what the clock on the wall shows
    std::function<std::vector<points::RelayStatus>()> relays;
    EventHub* events = nullptr;            ///< never null; outlives the server
    DiscoverySource* discovery = nullptr;  ///< null only where there are no lines; outlives it
    ReloadSource* reload = nullptr;  ///< null: the configuration cannot be read again; outlives it
    SharedText configuration;        ///< in force, a JSON object without secrets; null: not shown
    ApiSettings settings{};
};

/// Who is served: the gateway, or simulated panels alone, whose directory may be without buses.
enum class Surface : std::uint8_t { gateway, simulator };

/// HTTP/1.1: probes, metrics and the REST API. Lives in the one thread that runs the executor.
class Server {
  public:
    Server(boost::asio::any_io_executor executor, Settings settings,
           std::shared_ptr<const Directory> directory, Providers providers,
           Surface surface = Surface::gateway);
    /// Ends everything that stop() would let finish; answers still owed are not sent.
    ~Server();
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    /// Opens the listener. On an error (address in use, not an address…) nothing is open.
    boost::system::error_code start();
    /// Serves these from the next request on, for HttpListener::apply(); what runs ends on what was
    /// there when it came, and keeps it until then.
    void apply(Settings settings, std::shared_ptr<const Directory> directory,
               SharedText configuration);
    /// The port that is listened on; 0 before start().
    std::uint16_t port() const;
    /// Closes the listener and idle connections; running requests are answered, then closed. A
    /// client has no longer than `reading` to take an answer.
    void stop(Duration reading = 10s);
    /// Connections open now; after stop() it falls to 0.
    std::size_t connections() const;
    const Counters& counters() const;

  private:
    std::shared_ptr<const Site> site_of(Settings settings,
                                        std::shared_ptr<const Directory> directory) const;

    Providers providers_;
    Surface surface_;
    std::shared_ptr<KeyBook> keys_;
    std::shared_ptr<HttpListener> listener_;
};

}  // namespace panelgate::web
