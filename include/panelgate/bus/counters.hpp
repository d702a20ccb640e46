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

/// Request counters of one station.
struct StationReport {
    std::string station;  ///< its name; "other" for all unlisted stations
    /// By function code; kOtherFunctions: all that modbus::is_known() does not know. Contains the
    /// functions that were used or that the settings expect.
    std::map<std::uint8_t, OutcomeCounts> requests;
    /// Requests sent as another function: by function requested and function sent.
    std::map<std::pair<std::uint8_t, std::uint8_t>, std::uint64_t> translated;
    Histogram request_duration;
    arbiter::StationCounters wire;
    bool configured = false;
    std::optional<bool> up;                ///< whether it answers; nullopt if not asked yet
    std::optional<Condition> condition{};  ///< with `up`; not in listen mode
    double last_success_unix = 0;          ///< seconds since 1970; 0: never
};

/// A finding of the line doctor.
struct FindingReport {
    std::string cause;    ///< a stable identifier
    std::string station;  ///< its name; "all": the whole line
};

/// Everything that metrics/ copies from one line at a scrape.
struct LineReport {
    std::string line;
    bool up = false;
    std::size_t queue_depth = 0;
    arbiter::LineCounters wire;
    line::Counters device;
    std::vector<StationReport> stations;
    std::vector<FindingReport> findings;
    std::map<std::string, std::uint64_t>
        denials{};  ///< requests, by the rule of `access` that denies
};

}  // namespace panelgate::bus
