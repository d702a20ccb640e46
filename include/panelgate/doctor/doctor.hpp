#pragma once

#include <deque>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/doctor/finding.hpp"
#include "panelgate/doctor/sample.hpp"
#include "panelgate/doctor/settings.hpp"

namespace panelgate::doctor {

/// Watches the counts of one line over a moving window and tells when a finding appears and when it
/// goes. Pure: the owner says what time it is and what was counted. Bounded.
class Doctor {
  public:
    struct Change {
        std::vector<Finding> appeared;
        std::vector<Finding> gone;
    };

    Doctor(Settings settings, LineFacts facts);

    /// They are others now; what was found stands until the next look.
    void apply(LineFacts facts) { facts_ = std::move(facts); }
    /// The line was opened: what was counted before tells nothing about it, unless nothing but
    /// damage has come since the window began. Findings stay until there is something to judge by.
    void begin(TimePoint now, Sample counted);
    /// A step has passed since the window moved last.
    bool due(TimePoint now) const { return !marks_.empty() && now >= marks_.back().at + step(); }
    /// The last look was long enough ago for another one between two steps.
    bool rested(TimePoint now) const { return !marks_.empty() && now >= looked_ + settings_.rest; }
    /// Judges the window that ends now. `counted` holds the counts since the start.
    Change look(TimePoint now, const Sample& counted);

    /// As of the last look, the likeliest first.
    const std::vector<Finding>& findings() const { return findings_; }

  private:
    struct Mark {
        TimePoint at;
        Sample counted;
    };

    Duration step() const { return settings_.step; }
    void move_window(TimePoint now, const Sample& counted);

    Settings settings_;
    LineFacts facts_;
    std::deque<Mark> marks_;  ///< the first one begins the window
    TimePoint looked_{};
    std::vector<Finding> findings_;
};

}  // namespace panelgate::doctor
