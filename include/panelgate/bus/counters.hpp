#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/arbiter/counters.hpp"
#include "panelgate/base/histogram.hpp"
#include "panelgate/line/counters.hpp"

namespace panelgate::bus {

/// Counters of one station as clients see it.
struct StationReport {
    std::string station;  ///< its name; "other" for all that the configuration does not list
    /// By function label ("3"; "other" for codes outside Table A) and outcome.
    std::map<std::pair<std::string, std::string>, std::uint64_t> requests;
    Histogram request_duration;
    arbiter::StationCounters wire;
    bool configured = false;
    bool up = false;
    double last_success_unix = 0;  ///< seconds since 1970; 0 = never
};

/// Everything metrics/ copies from one line at a scrape.
struct LineReport {
    std::string line;
    bool up = false;
    std::size_t queue_depth = 0;
    arbiter::LineCounters wire;
    line::Counters device;
    std::vector<StationReport> stations;
};

}  // namespace panelgate::bus
