#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/arbiter/counters.hpp"
#include "panelgate/base/series.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/line/counters.hpp"

namespace panelgate::bus {

inline constexpr std::uint8_t kOtherFunctions = 0;

/// Counters of one station as clients see it.
struct StationReport {
    std::string station;  ///< its name; "other" for all that the configuration does not list
    /// By function code; kOtherFunctions: all that modbus::is_known() does not know. Those that
    /// were used, and those that the settings expect.
    std::map<std::uint8_t, OutcomeCounts> requests;
    /// Of these, those that went out with another function: by function asked and function sent.
    std::map<std::pair<std::uint8_t, std::uint8_t>, std::uint64_t> translated;
    Histogram request_duration;
    arbiter::StationCounters wire;
    bool configured = false;
    std::optional<bool> up;        ///< whether it answers; none while nobody has asked it
    double last_success_unix = 0;  ///< seconds since 1970; 0 = never
};

/// Everything metrics/ copies from one line at a scrape.
/// What the line doctor finds.
struct FindingReport {
    std::string cause;    ///< a stable word
    std::string station;  ///< its name; "all" of the whole line
};

struct LineReport {
    std::string line;
    bool up = false;
    std::size_t queue_depth = 0;
    arbiter::LineCounters wire;
    line::Counters device;
    std::vector<StationReport> stations;
    std::vector<FindingReport> findings;
};

}  // namespace panelgate::bus
