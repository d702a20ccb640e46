#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "panelgate/arbiter/counters.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/doctor/doctor.hpp"

namespace panelgate::bus {

/// A line's counters so far. UART counters are read from `line`.
struct LineCounts {
    const std::map<std::uint8_t, arbiter::StationCounters>& stations;
    std::uint64_t broadcasts = 0;
    line::Line& line;
};

/// Passes the counters of arbiter and device to the doctor and reports each change of its findings
/// once, to the log and to the observer. Has no timer: it runs on line activity or on request.
class LineDoctor {
  public:
    /// The settings outlive it.
    explicit LineDoctor(const Settings& settings);

    /// Call after the settings changed.
    void apply();

    void begin(TimePoint now, const LineCounts& counts);
    /// Withdraws what depends on a line that is up.
    void on_line_down();
    /// Call on line activity: judges at most once per step.
    void look(TimePoint now, const LineCounts& counts);
    /// Call before reading findings: judges unless it has just done so.
    void look_on_demand(TimePoint now, const LineCounts& counts);

    std::vector<LineFinding> findings() const;
    std::vector<FindingReport> report() const;

  private:
    void judge(TimePoint now, const LineCounts& counts);
    void report_change(const doctor::Finding& finding, bool is_new) const;

    const Settings& settings_;
    doctor::Doctor doctor_;
};

}  // namespace panelgate::bus
