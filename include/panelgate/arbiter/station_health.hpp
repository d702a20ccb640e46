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

/// Health of one station: online, suspect, offline. A transaction in which anything of the station
/// is heard is a sign of life; only silence counts towards offline (P4, T1). Pure.
class StationHealth {
  public:
    explicit StationHealth(OfflineSettings settings = {}) : settings_(settings) {}

    /// Applies from now on; pauses that have begun stay.
    void apply(const OfflineSettings& settings) { settings_ = settings; }

    /// The health shown everywhere. Unknown until the station is asked over the open line.
    Health state() const { return known_ ? state_ : Health::unknown; }
    bool offline() const { return state_ == Health::offline; }
    bool suspect() const { return state_ == Health::suspect; }
    /// Time of its last answer in time. A late reply is a sign of life but no success.
    std::optional<TimePoint> last_success() const { return last_success_; }
    /// Time of its last good frame, in time or late.
    std::optional<TimePoint> last_heard() const { return last_heard_; }
    int silent_in_a_row() const { return silent_; }
    /// How often it was heard again after a silence: each may have been a restart.
    std::uint64_t returns() const { return returns_; }

    /// An answer came in time. Returns true if the station was offline.
    bool on_reply(TimePoint now);
    /// A good frame of the station came too late to answer a request: alive, though not well.
    /// Returns true if that brought it back.
    bool on_late_reply(TimePoint now);
    /// Its line is down: its health is unknown.
    void on_line_down() { known_ = false; }
    /// Only damaged bytes came: alive, though not well.
    void on_damaged();
    /// A whole transaction (all its attempts) passed in silence. Returns true if that took it
    /// offline, after as many in a row as configured.
    bool on_silence(TimePoint now);
    /// The same for a write, at a station that answers reads: it may ignore only this write (T14).
    /// Counts to one silence short of offline at most; an offline station stays so. Returns true if
    /// a read must decide, because another silent transaction would have taken it offline.
    bool on_silent_write();

    /// When an offline station may be asked again; the line's budget may postpone it.
    TimePoint next_probe() const { return next_probe_; }
    /// Returns true if a client's request may be the probe now, once per interval.
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

/// Keeps the spent time below a share of the line's time (P4, T1): after a cost d nothing more is
/// allowed for d * (1 / share - 1). Unforeseen costs may exceed it, and are paid off later. Pure.
class ProbeBudget {
  public:
    static constexpr double kSuspect = 0.2;   ///< of stations whose last requests failed, together
    static constexpr double kIgnored = 0.05;  ///< of writes that stations ignore, together
    static constexpr double kOffline = 0.03;  ///< of offline stations, together
    static constexpr double kAlone = 0.5;     ///< ... while an outage of all has only just begun

    explicit ProbeBudget(double share) : share_(share) {}

    bool allows(TimePoint now) const { return now >= next_; }
    TimePoint next() const { return next_; }
    /// An unanswered attempt that occupied the line for `cost` ended at `now`. Earlier excess is
    /// remembered up to what takes `most` to pay off.
    void spend(TimePoint now, Duration cost, Duration most = {}) {
        const Duration whole = time_for(cost);
        const TimePoint began = now - cost;
        next_ = std::max(began + whole, std::min(std::max(next_, began) + whole, now + most));
    }
    void clear() { next_ = {}; }
    /// Time of which `cost` is the share.
    Duration time_for(Duration cost) const {
        const std::chrono::duration<double> time(to_seconds(cost) / share_);
        return std::chrono::duration_cast<Duration>(time);
    }

  private:
    double share_;
    TimePoint next_{};
};

}  // namespace panelgate::arbiter
