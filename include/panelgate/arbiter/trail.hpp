#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// Learns what always stands behind the replies of one station (the glitches of a transceiver that
/// lets go, a second copy) and how long it lasts: what is sent meanwhile is damaged by it. Looks at
/// the last kReplies replies, so that it is unlearned as soon as it stops. Pure.
class Trail {
  public:
    static constexpr std::size_t kReplies = 8;
    static constexpr int kOften = 3;            ///< of them: no accident
    static constexpr Duration kLongest = 60ms;  ///< later, it is something else

    /// `frame`: what a usual reply takes on this line; its copy ends that much later.
    explicit Trail(Duration frame = {}) : longest_(kLongest + frame) {}

    Duration longest() const { return longest_; }
    /// A reply ended. What was seen behind the one before is remembered.
    void on_reply(TimePoint now) {
        delays_[next_++ % kReplies] = last_;
        last_ = {};
        at_ = now;
        seen_ = false;
    }
    /// Bytes that belong to nobody, their last one now.
    void on_stray(TimePoint now) {
        const Duration delay = now - at_;
        if (delay <= Duration::zero() || delay > longest_) return;
        last_ = std::max(last_, delay);
        seen_ = true;
    }
    /// Until when the line had better be left alone; in the past when nothing is to be expected.
    TimePoint until() const { return seen_ ? TimePoint{} : at_ + hold(); }
    /// From the end of a reply to the end of what stands behind it; 0: nothing, as a rule.
    Duration hold() const {
        const auto often =
            std::ranges::count_if(delays_, [](Duration delay) { return delay > Duration::zero(); });
        return often < kOften ? Duration::zero() : *std::ranges::max_element(delays_) * 5 / 4;
    }
    bool seen() const { return seen_; }

  private:
    Duration longest_;
    std::array<Duration, kReplies> delays_{};
    std::size_t next_ = 0;
    Duration last_{};
    TimePoint at_{};
    bool seen_ = false;
};

}  // namespace panelgate::arbiter
