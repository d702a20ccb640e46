#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/bus/counters.hpp"
#include "panelgate/config/counters.hpp"
#include "panelgate/metrics/process.hpp"
#include "panelgate/mqtt/counters.hpp"
#include "panelgate/points/counters.hpp"
#include "panelgate/rt/counters.hpp"
#include "panelgate/serial_server/counters.hpp"
#include "panelgate/tcp_server/counters.hpp"
#include "panelgate/web/http/counters.hpp"

namespace panelgate::metrics {

/// Everything that one scrape shows, copied after it was asked for. Each line is of one instant.
struct Snapshot {
    std::vector<bus::LineReport> lines;
    std::vector<tcp_server::Counters> listeners;
    std::vector<serial_server::Counters> serial_masters;
    std::deque<points::PointSample> points;  ///< many: growing moves none of them
    std::vector<points::RelaySample> relays;
    std::optional<web::Counters> http;
    std::optional<mqtt::Counters> mqtt;             ///< nothing: there is no broker
    std::optional<config::ReloadCounters> reloads;  ///< nothing: of a built-in configuration
    std::string version;
    std::string commit;    ///< empty: not told
    std::string compiler;  ///< the same
    ProcessFacts process;
    rt::Counters runtime;
};

/// The Content-Type that goes with exposition().
inline constexpr std::string_view kContentType = "text/plain; version=0.0.4; charset=utf-8";

/// A piece of the text; false: no more of it is wanted.
using TakeText = std::function<bool(std::string_view)>;

/// The text of /metrics (README, Metrics), a family at a time. What a station's panel is expected
/// to be asked exists with 0, so that a rate() sees the first event: for requests the outcome ok of
/// the functions that the bus lists before they are used, and ok, exception and timeout of those
/// that were; for exceptions codes 1-4. Other outcomes are there once they happened. A station's
/// last success is absent while there was none. Touches nothing but the snapshot.
void exposition(const Snapshot& snapshot, const TakeText& take);
std::string exposition(const Snapshot& snapshot);

}  // namespace panelgate::metrics
