#pragma once

#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/audit/counters.hpp"
#include "panelgate/bus/counters.hpp"
#include "panelgate/config/counters.hpp"
#include "panelgate/metrics/process.hpp"
#include "panelgate/mqtt/counters.hpp"
#include "panelgate/points/counters.hpp"
#include "panelgate/rt/counters.hpp"
#include "panelgate/serial_server/counters.hpp"
#include "panelgate/store/counters.hpp"
#include "panelgate/tcp_server/counters.hpp"
#include "panelgate/tls/counters.hpp"
#include "panelgate/web/http/counters.hpp"

namespace panelgate::metrics {

/// A finding of the gateway itself; `line`: of an overload, else empty.
struct FindingSample {
    std::string line;
    std::string cause;
    std::string name;
};

/// The data of one scrape, copied when it was requested. Each line's data is consistent.
struct Snapshot {
    std::vector<bus::LineReport> lines;
    std::vector<FindingSample> findings{};
    std::map<std::string, bool> active{};  ///< by line that another box shares: this box drives it
    std::vector<tcp_server::Counters> listeners;
    std::vector<serial_server::Counters> serial_masters;
    std::deque<points::PointSample> points;  ///< deque: many points, never moved
    std::vector<points::RelaySample> relays;
    std::optional<web::Counters> http;
    std::optional<mqtt::Counters> mqtt;      ///< nullopt: no broker
    std::optional<audit::Counters> audit{};  ///< nullopt: no audit
    std::optional<store::Counters> store{};
    struct Alarm {
        std::string name{};
        std::string severity{};
        bool active = false;
    };
    std::vector<Alarm> alarms{};
    std::optional<config::ReloadCounters> reloads;    ///< nullopt: built-in configuration
    std::map<std::string, tls::Renewals> renewals{};  ///< by listener, as its other metrics name it
    std::string version;
    std::string commit;    ///< empty: unknown
    std::string compiler;  ///< the same
    ProcessFacts process;
    rt::Counters runtime;
};

/// The Content-Type of exposition().
inline constexpr std::string_view kContentType = "text/plain; version=0.0.4; charset=utf-8";

/// Receives a piece of the text; returns false if no more is wanted.
using TextSink = std::function<bool(std::string_view)>;

/// Writes the text of /metrics (docs/reference/metrics.md), one family at a time. Expected series
/// exist with 0, so that a rate() sees the first event: requests with outcome ok for the functions
/// the bus lists before their first use, and with ok, exception and timeout for those used;
/// exceptions with codes 1-4. Other outcomes appear once they occur. A station's last success is
/// absent until the first. Reads only the snapshot.
void exposition(const Snapshot& snapshot, const TextSink& take);
std::string exposition(const Snapshot& snapshot);

}  // namespace panelgate::metrics
