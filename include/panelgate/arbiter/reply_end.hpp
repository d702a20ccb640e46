#pragma once

#include <algorithm>

#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

// When replies are over, as looks at them have told. One look in kLooks is to come too early, and
// then the last bytes tell: who never looks too early does not know how much the wire idles. Pure.

inline constexpr int kLooks = 8;

/// What a line's machine takes to notice that a reply has begun, and to wake up for its end.
class Notice {
  public:
    static constexpr Duration kMost = 200us;

    /// So much sooner than it seems a reply is over; less than nothing: later.
    Duration early() const { return early_; }
    /// A reply was looked at so early. `whole`: it was all there.
    void on_look(bool whole) {
        early_ = std::clamp(early_ + (whole ? kStep : (1 - kLooks) * kStep), -kMost, kMost);
    }

  private:
    static constexpr Duration kStep = 1us;

    Duration early_{};
};

/// By which share a panel's clock is faster than ours.
class Drift {
  public:
    static constexpr int kMost = 40'000;  ///< ppm: two clocks that differ by 2 %, and some more

    /// So much sooner a reply is over that takes so long at the line's rate.
    Duration early(Duration reply) const { return reply * ppm_ / 1'000'000; }
    /// As Notice::on_look(); a long reply tells more.
    void on_look(Duration reply, bool whole) {
        const int length = static_cast<int>(std::clamp<Duration>(reply, 1ms, 32ms) / 1ms);
        const int step = kStep * length;
        ppm_ = std::clamp(ppm_ + (whole ? step : (1 - kLooks) * step), -kMost, kMost);
    }

  private:
    static constexpr int kStep = 3;  ///< ppm a millisecond

    int ppm_ = 0;
};

}  // namespace panelgate::arbiter
