#pragma once

#include <algorithm>

#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// Keeps all that is spent from it below a share of the line's time: after something that cost d
/// nothing more is allowed for d * (1 / share - 1). What is spent all the same, because it could
/// not be foreseen, is a debt. Pure.
class ProbeBudget {
  public:
    /// Of stations that are offline, together (P4: at most 5 %, aiming at 3 %).
    static constexpr double kOffline = 0.03;
    /// ... for the time in which an outage of all has only just begun: a network may have hung.
    static constexpr double kAlone = 0.5;
    /// Of stations that have just fallen silent, together; and of each one that keeps failing.
    static constexpr double kFailing = 0.2;
    /// Of ids that nobody listed and nobody has heard, together: once they have been asked.
    static constexpr double kStrangers = 0.02;

    explicit ProbeBudget(double share) : share_(share) {}

    /// `credit`: a debt that takes so long to be paid is no reason to wait.
    bool allows(TimePoint now, Duration credit = {}) const { return now + credit >= next_; }
    TimePoint next() const { return next_; }
    /// Something without a reply ended at `now` after having kept the line for `cost`. Of the debt
    /// before so much is remembered as takes `most` to be paid.
    void spend(TimePoint now, Duration cost, Duration most = {}) {
        const Duration whole = time_for(cost);
        const TimePoint began = now - cost;
        next_ = std::max(began + whole, std::min(std::max(next_, began) + whole, now + most));
    }
    /// What was spent last costs so much more.
    void add(Duration cost) { next_ += time_for(cost); }
    void clear() { next_ = {}; }

  private:
    /// In which it is the share.
    Duration time_for(Duration cost) const {
        const std::chrono::duration<double> time(to_seconds(cost) / share_);
        return std::chrono::duration_cast<Duration>(time);
    }

    double share_;
    TimePoint next_{};
};

}  // namespace panelgate::arbiter
