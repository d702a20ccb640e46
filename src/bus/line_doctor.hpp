#pragma once

#include <vector>

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/doctor/doctor.hpp"

namespace panelgate::bus {

/// Joins what the arbiter and the device have counted, has it judged, and says each change once: in
/// the log and to the observer. Wakes nobody: it looks when something happens, or somebody asks.
class LineDoctor {
  public:
    /// The settings outlive it.
    explicit LineDoctor(const Settings& settings);

    void begin(TimePoint now, const arbiter::Arbiter& arbiter, line::Line& line);
    /// Something happened: looks once a step.
    void look(TimePoint now, const arbiter::Arbiter& arbiter, line::Line& line);
    /// Somebody wants to know: looks unless it has just done so.
    void glance(TimePoint now, const arbiter::Arbiter& arbiter, line::Line& line);

    std::vector<LineFinding> findings() const;

  private:
    void judge(TimePoint now, const arbiter::Arbiter& arbiter, line::Line& line);
    void say(const doctor::Finding& finding, bool is_new) const;

    const Settings& settings_;
    doctor::Doctor doctor_;
};

}  // namespace panelgate::bus
