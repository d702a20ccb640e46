#pragma once

#include <cstdint>
#include <optional>

#include "panelgate/base/health.hpp"
#include "panelgate/base/time.hpp"

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

    Health state() const { return state_; }
    bool offline() const { return state_ == Health::offline; }
    std::optional<TimePoint> last_success() const { return last_success_; }
    int silent_in_a_row() const { return silent_; }
    /// How often it was heard again after a silence: each may have been a restart.
    std::uint64_t returns() const { return returns_; }

    /// A good frame of the station came, in time or late. True when that brought it back.
    bool on_reply(TimePoint now);
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
    int silent_ = 0;
    std::uint64_t returns_ = 0;
    Duration pause_{};
    TimePoint next_probe_{};
    TimePoint next_half_open_{};
    std::optional<TimePoint> last_success_;
};

}  // namespace panelgate::arbiter
