#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"

namespace panelgate::arbiter {

struct OfflineSettings {
    int after = 3;               ///< silent transactions in a row; 1..1000
    Duration probe_min = 500ms;  ///< first pause between two probes
    Duration probe_max = 5s;     ///< the pause doubles up to here
    friend bool operator==(const OfflineSettings&, const OfflineSettings&) = default;
};

/// What is known of one station's life. Pure. A transaction that hears anything of the station,
/// damaged or an exception, is a sign of life; only silence counts towards offline (P4).
class StationHealth {
  public:
    explicit StationHealth(OfflineSettings settings = {}) : settings_(settings) {}

    /// From now on; pauses that have begun stay.
    void apply(const OfflineSettings& settings) { settings_ = settings; }

    /// What every face shows. Unknown until the station was asked, and from the loss of its line
    /// until it has answered, or not, behind that.
    Health state() const { return known_ ? state_ : Health::unknown; }
    bool offline() const { return state_ == Health::offline; }
    /// Its last answer in time. A late reply is a sign of life and no success.
    std::optional<TimePoint> last_success() const { return last_success_; }
    /// Its last good frame, in time or late.
    std::optional<TimePoint> last_heard() const { return last_heard_; }
    int silent_in_a_row() const { return silent_; }
    /// How often it was heard again after a silence: each may have been a restart.
    std::uint64_t returns() const { return returns_; }

    /// Its answer came in time. True when that brought it back.
    bool on_reply(TimePoint now);
    /// A good frame of the station came that answers nobody any more: alive, though not well. True
    /// when that brought it back.
    bool on_late_reply(TimePoint now);
    /// Its line is down: nothing is known of it any more.
    void on_line_down() { known_ = false; }
    /// Only damaged bytes came: alive, though not well.
    void on_damaged();
    /// A whole transaction (all its attempts) passed in silence. True when that took it offline:
    /// `at_once`, or after as many in a row as the settings say.
    bool on_silence(TimePoint now, bool at_once = false);
    /// The same of a write, at a station that answers reads: it may ignore this write alone. One
    /// silence short of offline at most; what is offline stays as it is. True when a read is to
    /// tell, because any other transaction would have taken it offline.
    bool on_silent_write();

    /// When an offline station may be asked again; the budget of the line may postpone it.
    TimePoint next_probe() const { return next_probe_; }
    /// A client's write may be the probe, once an interval: true if this one may, and then it is.
    bool take_half_open(TimePoint now);

  private:
    OfflineSettings settings_;
    Health state_ = Health::unknown;
    bool known_ = false;  ///< since the line was opened
    int silent_ = 0;
    std::uint64_t returns_ = 0;
    Duration pause_{};
    TimePoint next_probe_{};
    TimePoint next_half_open_{};
    std::optional<TimePoint> last_success_;
    std::optional<TimePoint> last_heard_;
};

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
