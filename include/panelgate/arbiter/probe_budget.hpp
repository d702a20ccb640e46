#pragma once

#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// Keeps all that is spent from it below a share of the line's time: after something that cost d
/// nothing more is allowed for d * (1 / share - 1). Pure.
class ProbeBudget {
  public:
    /// Of stations that are offline, together (P4: at most 5 %, aiming at 3 %).
    static constexpr double kOffline = 0.03;
    /// ... for the time in which an outage of all has only just begun: a network may have hung.
    static constexpr double kAlone = 0.5;
    /// Of stations that have just fallen silent, together; and of each one that keeps failing.
    static constexpr double kFailing = 0.2;

    explicit ProbeBudget(double share) : share_(share) {}

    bool allows(TimePoint now) const { return now >= next_; }
    TimePoint next() const { return next_; }
    /// Something without a reply ended at `now` after having kept the line for `cost`.
    void spend(TimePoint now, Duration cost) {
        const double rest = to_seconds(cost) * (1.0 / share_ - 1.0);
        next_ = now + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(rest));
    }
    void clear() { next_ = {}; }

  private:
    double share_;
    TimePoint next_{};
};

}  // namespace panelgate::arbiter
