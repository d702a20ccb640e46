#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/bus/counters.hpp"
#include "panelgate/metrics/process.hpp"
#include "panelgate/points/counters.hpp"
#include "panelgate/rt/counters.hpp"
#include "panelgate/tcp_server/counters.hpp"
#include "panelgate/web/http/counters.hpp"

namespace panelgate::metrics {

/// Everything that one scrape shows, copied at the scrape.
struct Snapshot {
    std::vector<bus::LineReport> lines;
    std::vector<tcp_server::Counters> listeners;
    std::vector<points::PointSample> points;
    std::vector<points::RelaySample> relays;
    std::optional<web::Counters> http;
    std::string version;
    ProcessFacts process;
    rt::Counters runtime;
};

/// The Content-Type that goes with exposition().
inline constexpr std::string_view kContentType = "text/plain; version=0.0.4; charset=utf-8";

/// The text of /metrics (README, Metrics). Series exist from the start with 0, so that a rate()
/// sees the first event: for requests functions 1-6, 15 and 16 with the outcomes ok, exception,
/// timeout and damaged, and every outcome of a function that was used; for exceptions codes 1-4. A
/// station's last success is absent while there was none.
std::string exposition(const Snapshot& snapshot);

}  // namespace panelgate::metrics
