#pragma once

#include <cstdint>
#include <map>

#include "panelgate/base/time.hpp"
#include "plan.hpp"

namespace panelgate::scenario {

/// What anybody who listens to the wire could know of each station, and what its plan says.
class Watch {
  public:
    explicit Watch(const Plan& plan);

    /// A request to it, or its answer, was hit by somebody else's bytes.
    void on_collision(TimePoint now, std::uint8_t station);
    /// The line, the way to it or the process were not there: that excuses everything for a while.
    void on_upset(TimePoint now);
    /// It answered. True if that is the first time since a disturbance.
    bool on_answered(TimePoint now, std::uint8_t station);
    void on_unanswered(std::uint8_t station, bool silent, bool is_read);
    /// P4: an unanswered attempt took `cost`, and a station's failures have a fifth of the line.
    void on_cost(TimePoint now, std::uint8_t station, Duration cost);
    /// When what its failures have taken is a fifth again.
    TimePoint paid(std::uint8_t station) const;
    /// A reply of it may come until then that answers an earlier request.
    void on_owed(std::uint8_t station, TimePoint until);

    /// A gateway can get each of its answers, and nothing has hit it since then.
    bool is_good(std::uint8_t station, TimePoint since) const;
    /// It does nothing wrong but dying, so that its silence has no other reason.
    bool only_dies(std::uint8_t station) const;
    /// Until then it is to be left alone (P1), but for the very same request.
    TimePoint rests_until(std::uint8_t station) const;
    /// Its last attempt was not answered.
    bool is_failing(std::uint8_t station) const;
    /// It has not answered since it was last silent.
    bool is_silent(std::uint8_t station) const;
    /// The same, and it was silent to a read: a write may be ignored (T14).
    bool is_silent_to_reads(std::uint8_t station) const;

  private:
    struct Station {
        bool sound = false;
        bool only_dies = false;
        bool disturbed = false;
        bool silent = false;
        bool silent_to_reads = false;
        bool failing = false;
        TimePoint rests{};
        TimePoint paid{};
        TimePoint settled{};  ///< the last disturbance was over
    };
    const Station* find(std::uint8_t station) const;

    std::map<std::uint8_t, Station> stations_;
};

}  // namespace panelgate::scenario
