#include "panelgate/bus/load_meter.hpp"

#include <algorithm>

namespace panelgate::bus {

/// What lies before the ring is as idle as what was never busy.
void LoadMeter::advance_to(std::int64_t second) {
    const std::int64_t first = std::max(newest_ + 1, second - kSeconds);
    for (std::int64_t next = first; next <= second; ++next) of(next) = {};
    newest_ = std::max(newest_, second);
}

void LoadMeter::record(TimePoint now, Duration busy) {
    Duration added = busy - known_;
    if (added <= Duration::zero()) return;
    known_ = busy;
    advance_to(second_of(now));
    const std::int64_t oldest = std::max<std::int64_t>(newest_ - kSeconds, 0);
    TimePoint end = now;
    for (std::int64_t second = newest_; second >= oldest && added > Duration::zero(); --second) {
        const Duration here = std::min(added, end - (start_ + second * 1s));
        of(second) += here;
        added -= here;
        end -= here;
    }
}

double LoadMeter::percent(TimePoint now) const {
    const std::int64_t second = second_of(now);
    if (second == 0) {  // no whole second yet
        const Duration span = now - start_;
        if (span <= Duration::zero()) return 0;
        return std::min(100.0, 100.0 * to_seconds(seconds_[0]) / to_seconds(span));
    }
    const std::int64_t first = std::max<std::int64_t>(second - kSeconds, 0);
    Duration busy{};
    for (std::int64_t one = std::max(first, newest_ - kSeconds); one < second && one <= newest_;
         ++one) {
        busy += seconds_[static_cast<std::size_t>(one) % seconds_.size()];
    }
    return std::min(100.0, 100.0 * to_seconds(busy) / static_cast<double>(second - first));
}

}  // namespace panelgate::bus
