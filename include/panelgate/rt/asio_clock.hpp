#pragma once

#include <algorithm>
#include <boost/asio/any_io_executor.hpp>
#include <memory>

#include "panelgate/base/time.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::rt {

/// Compensates for the wake-up latency of the system's timer, some 30 us on an idle machine: how
/// much earlier to set it, so that a sharp alarm can busy-wait for the rest. Adapts to a lead that
/// covers two of three wake-ups; busy-waiting takes at most a thirtieth of the time. Pure.
class LeadTime {
  public:
    static constexpr Duration kMost = 80us;

    /// Zero while the budget for busy-waiting is used up.
    Duration lead() const { return allowance_ > Duration::zero() ? lead_ : Duration::zero(); }
    /// Reports a wake-up that was `late`, after which the clock was busy-polled for `watched`.
    void on_rung(TimePoint now, Duration late, Duration watched) {
        constexpr Duration kUp = 200ns;  // twice kDown: two of three wake-ups are below
        constexpr Duration kDown = 100ns;
        lead_ = std::clamp(late > lead_ ? lead_ + kUp : lead_ - kDown, Duration::zero(), kMost);
        const Duration passed = std::min(now - last_, kShare * kSaved);
        allowance_ = std::min(kSaved, allowance_ + passed / kShare) - watched;
        last_ = now;
    }

  private:
    static constexpr int kShare = 30;
    static constexpr Duration kSaved = 10ms;  ///< of busy-waiting, saved up at most

    Duration lead_ = 40us;
    Duration allowance_ = kSaved;
    TimePoint last_{};
};

/// The system's monotonic clock; its alarms fire from the executor's loop. Apart from
/// wall_seconds() the only code that reads the system's time.
class AsioClock final : public Clock {
  public:
    /// Throws std::system_error if no timerfd can be created.
    explicit AsioClock(const boost::asio::any_io_executor& executor);

    TimePoint now() const override { return read(); }
    /// The same, from any thread.
    static TimePoint read();
    std::unique_ptr<Alarm> make_alarm() override;

  private:
    class Alarms;

    std::shared_ptr<Alarms> alarms_;
};

}  // namespace panelgate::rt
