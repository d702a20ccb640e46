#pragma once

#include "panelgate/base/time.hpp"

namespace panelgate::bus {

/// The busy share of a line over the last 5 to 10 seconds. Pure.
class LoadMeter {
  public:
    /// `busy` only grows. Returns per cent, 0..100.
    double update(TimePoint now, Duration busy) {
        if (now - current_.at > kWindow) {
            previous_ = current_;
            current_ = {now, busy};
        }
        const Duration span = now - previous_.at;
        if (span <= Duration::zero()) return 0;
        const double percent = 100.0 * to_seconds(busy - previous_.busy) / to_seconds(span);
        return percent > 100.0 ? 100.0 : percent;
    }

  private:
    static constexpr Duration kWindow = 5s;
    struct Mark {
        TimePoint at;
        Duration busy{};
    };
    Mark previous_;
    Mark current_;
};

}  // namespace panelgate::bus
