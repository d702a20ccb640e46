#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "panelgate/arbiter/counters.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/doctor/doctor.hpp"

namespace panelgate::bus {

/// What a line has counted so far. The wire is asked for what its driver has.
struct LineCounts {
    const std::map<std::uint8_t, arbiter::StationCounters>& stations;
    std::uint64_t broadcasts = 0;
    line::Line& line;
};

/// Joins what the arbiter and the device have counted, has it judged, and says each change once: in
/// the log and to the observer. Wakes nobody: it looks when something happens, or somebody asks.
class LineDoctor {
  public:
    /// The settings outlive it.
    explicit LineDoctor(const Settings& settings);

    /// Those are others now.
    void apply();

    void begin(TimePoint now, const LineCounts& counts);
    /// Something happened: looks once a step.
    void look(TimePoint now, const LineCounts& counts);
    /// Somebody wants to know: looks unless it has just done so.
    void glance(TimePoint now, const LineCounts& counts);

    std::vector<LineFinding> findings() const;
    std::vector<FindingReport> report() const;

  private:
    void judge(TimePoint now, const LineCounts& counts);
    void say(const doctor::Finding& finding, bool is_new) const;

    const Settings& settings_;
    doctor::Doctor doctor_;
};

}  // namespace panelgate::bus
