#pragma once

#include <cstdint>
#include <map>
#include <optional>

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
    /// It answered `after` the computed end of the request. True if that is the first since a
    /// disturbance.
    bool on_answered(TimePoint now, std::uint8_t station, Duration after);
    void on_unanswered(TimePoint now, std::uint8_t station, bool silent);
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
    bool is_known(std::uint8_t station) const;
    bool has_answered(std::uint8_t station) const;
    /// Somebody was told that nobody answered, even if the answer came later.
    void on_timeout(TimePoint now) { last_unanswered_ = now; }
    /// Its last attempt is made once more: whatever came of it could not be believed.
    void on_again(TimePoint now, std::uint8_t station);
    /// It answered the last time and more often than not lately, and no other has just fallen
    /// silent: several may have died.
    bool is_trusted(TimePoint now, std::uint8_t station) const;
    /// The longest that it has needed so far; of one that has never answered: any of the line.
    std::optional<Duration> slowest(std::uint8_t station) const;
    /// Of the station alone.
    Duration own_slowest(std::uint8_t station) const;

  private:
    struct Station {
        bool listed = false;
        bool sound = false;
        bool only_dies = false;
        bool disturbed = false;
        bool silent = false;
        bool failing = false;
        std::uint8_t lately = 0;  ///< the last 8 attempts, the latest lowest: 1 was in vain
        TimePoint rests{};
        TimePoint settled{};  ///< the last disturbance was over
        std::optional<Duration> slowest;
    };
    const Station* find(std::uint8_t station) const;

    std::map<std::uint8_t, Station> stations_;
    std::optional<Duration> slowest_;
    TimePoint last_unanswered_{};
};

}  // namespace panelgate::scenario
