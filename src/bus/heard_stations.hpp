#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "panelgate/arbiter/counters.hpp"
#include "panelgate/base/health.hpp"
#include "panelgate/base/outcome.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/bus/station_settings.hpp"
#include "panelgate/tap/heard.hpp"

namespace panelgate::bus {

/// How a request ended that was heard, not one of ours.
Outcome outcome_of(const tap::Transaction& heard);

/// What was heard of the stations of a line whose master is somebody else. Pure.
class HeardStations {
  public:
    using Wire = std::map<std::uint8_t, arbiter::StationCounters>;

    /// `offline_after`: silences in a row.
    HeardStations(const Stations& listed, int offline_after);
    /// What was counted on the wire of stations that are no longer listed is forgotten.
    void apply(const Stations& listed, int offline_after);

    void count(const tap::Transaction& heard);
    void count(const tap::Frame& frame);

    Health health(std::uint8_t station) const;
    StationStatus status(std::uint8_t station, TimePoint now) const;
    /// 0: all that are not listed.
    const Wire& wire() const { return wire_; }
    const arbiter::LineCounters& line() const { return line_; }

  private:
    struct One {
        HeardCounts counts;
        int silences = 0;  ///< in a row, up to now
        bool failed = false;
        std::optional<TimePoint> last_success;
    };
    arbiter::StationCounters& wire_of(std::uint8_t station);
    void count_answer(One& one, const tap::Transaction& heard);
    void count_failure(One& one, const tap::Transaction& heard);

    int offline_after_ = 1;
    std::map<std::uint8_t, One> stations_;
    Wire wire_;
    arbiter::LineCounters line_;
};

}  // namespace panelgate::bus
