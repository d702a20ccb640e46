#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/arbiter/counters.hpp"
#include "panelgate/base/health.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/bus/counters.hpp"
#include "panelgate/bus/station_settings.hpp"

namespace panelgate::bus {

Outcome outcome_of(const Answer& answer);

/// Counts requests by station, function and outcome. Stations the configuration does not list share
/// one entry, functions that nobody knows one label: no client can add a series (P10).
class RequestCounters {
  public:
    explicit RequestCounters(const Stations& stations);
    /// What was counted of stations that are no longer listed is forgotten.
    void apply(const Stations& stations);

    void count(std::uint8_t station, std::uint8_t function, Outcome outcome, Duration took);
    /// One that was counted went out as function `sent`.
    void translated(std::uint8_t station, std::uint8_t function, std::uint8_t sent) {
        ++of(station).translated[{function, sent}];
    }
    void succeeded(std::uint8_t station, double wall);
    /// Of all functions; none of a station that is not configured.
    OutcomeCounts outcomes(std::uint8_t station) const;
    /// Joined with what the arbiter counted on the wire.
    std::vector<StationReport> report(const arbiter::Arbiter& arbiter) const;
    /// ... or with what was heard there.
    std::vector<StationReport> report(const std::map<std::uint8_t, arbiter::StationCounters>& wire,
                                      const std::function<Health(std::uint8_t)>& health) const;

  private:
    StationReport& of(std::uint8_t station);

    std::map<std::uint8_t, StationReport> stations_;  ///< 0: the others, and broadcasts
};

}  // namespace panelgate::bus
