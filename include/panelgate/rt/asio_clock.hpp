#pragma once

#include <algorithm>
#include <boost/asio/any_io_executor.hpp>
#include <memory>

#include "panelgate/base/time.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::rt {

/// A system's timer rings late: the machine has to wake up, some 30 us where it idles. How much
/// earlier it is to be set, so that who must be on time can watch the clock for the rest. As much
/// as two of three are late; watching takes at most a thirtieth of the time. Pure.
class LeadTime {
  public:
    static constexpr Duration kMost = 80us;

    /// None while the share is used up.
    Duration lead() const { return allowance_ > Duration::zero() ? lead_ : Duration::zero(); }
    /// The timer rang so late, and for so long the clock was watched.
    void on_rung(TimePoint now, Duration late, Duration watched) {
        constexpr Duration kUp = 200ns;  // twice the way down: two of three are below
        constexpr Duration kDown = 100ns;
        lead_ = std::clamp(late > lead_ ? lead_ + kUp : lead_ - kDown, Duration::zero(), kMost);
        const Duration passed = std::min(now - last_, kShare * kSaved);
        allowance_ = std::min(kSaved, allowance_ + passed / kShare) - watched;
        last_ = now;
    }

  private:
    static constexpr int kShare = 30;
    static constexpr Duration kSaved = 10ms;  ///< of watching, after a rest

    Duration lead_ = 40us;
    Duration allowance_ = kSaved;
    TimePoint last_{};
};

/// The machine's monotonic clock; its alarms ring from the executor's loop. With wall_seconds() the
/// only place that asks the machine for the time.
class AsioClock final : public Clock {
  public:
    /// Throws std::system_error when the system has no timer left.
    explicit AsioClock(const boost::asio::any_io_executor& executor);

    TimePoint now() const override;
    std::unique_ptr<Alarm> make_alarm() override;

  private:
    class Alarms;

    std::shared_ptr<Alarms> alarms_;
};

}  // namespace panelgate::rt
