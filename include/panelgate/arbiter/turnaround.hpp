#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// How long one station has needed to think, lately. Pure.
class Turnaround {
  public:
    static constexpr std::size_t kSamples = 64;
    static constexpr std::size_t kEnough = 8;

    void add(Duration think) {
        samples_[next_++ % kSamples] = think;
        count_ = std::min(count_ + 1, kSamples);
    }
    bool known() const { return count_ >= kEnough; }
    /// Of the last kSamples replies: `share` of them took at most this long; 0 < share <= 1.
    Duration quantile(double share) const {
        if (count_ == 0) return {};
        auto sorted = samples_;
        const auto last = sorted.begin() + static_cast<std::ptrdiff_t>(count_);
        const auto rank = static_cast<std::size_t>(share * static_cast<double>(count_));
        const auto nth = sorted.begin() + static_cast<std::ptrdiff_t>(std::min(rank, count_ - 1));
        std::nth_element(sorted.begin(), nth, last);
        return *nth;
    }

    /// quantile(share) >= bound; something is known.
    bool reaches(double share, Duration bound) const {
        const auto rank = static_cast<std::size_t>(share * static_cast<double>(count_));
        const auto below = static_cast<std::size_t>(
            std::count_if(samples_.begin(), samples_.begin() + static_cast<std::ptrdiff_t>(count_),
                          [&](Duration sample) { return sample < bound; }));
        return below <= std::min(rank, count_ - 1);
    }

  private:
    std::array<Duration, kSamples> samples_{};
    std::size_t next_ = 0;
    std::size_t count_ = 0;
};

/// A response timeout that follows the turnaround (`response_timeout: adaptive`): the floor and
/// twice what 98 of 100 replies have needed, doubled after each timeout in a row; never above the
/// ceiling, which it also is until enough is known. Pure.
class AdaptiveTimeout {
  public:
    AdaptiveTimeout(Duration floor, Duration ceiling) : floor_(floor), ceiling_(ceiling) {}

    void apply(Duration floor, Duration ceiling) {
        floor_ = floor;
        ceiling_ = ceiling;
    }
    void on_reply() { silent_ = 0; }
    void on_timeout() { silent_ = std::min(silent_ + 1, 16); }
    Duration value(const Turnaround& seen) const {
        if (!seen.known()) return ceiling_;
        const Duration wanted = (floor_ + 2 * seen.quantile(0.98)) * (1 << silent_);
        return std::min(wanted, ceiling_);
    }

  private:
    Duration floor_;
    Duration ceiling_;
    int silent_ = 0;
};

/// Tells once that a station has come near its response timeout, and again after it had recovered.
/// Pure.
class DriftAlarm {
  public:
    /// True when it is to be told: 95 of 100 replies no longer keep below 80 % of the timeout.
    bool check(const Turnaround& seen, Duration timeout) {
        if (!seen.known()) return false;
        constexpr double kMost = 0.95;
        if (told_) told_ = seen.reaches(kMost, timeout * 6 / 10);
        if (told_ || !seen.reaches(kMost, timeout * 8 / 10)) return false;
        told_ = true;
        return true;
    }

  private:
    bool told_ = false;
};

}  // namespace panelgate::arbiter
