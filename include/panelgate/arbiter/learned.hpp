#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "panelgate/arbiter/timing.hpp"
#include "panelgate/base/time.hpp"

/// The four numbers that are learned of a station, each from frames alone.
namespace panelgate::arbiter {

/// How long a station needs until the first sign of its reply (T1): the last kSamples. Pure.
class ThinkTimes {
  public:
    static constexpr std::size_t kSamples = 64;
    static constexpr std::size_t kEnough = 8;

    void add(Duration time) {
        samples_[next_++ % kSamples] = time;
        count_ = std::min(count_ + 1, kSamples);
    }
    bool known() const { return count_ >= kEnough; }
    /// `share` of the replies took at most this long; 0 < share <= 1. 0: none is known.
    Duration quantile(double share) const {
        if (count_ == 0) return {};
        auto sorted = samples_;
        const auto last = sorted.begin() + static_cast<std::ptrdiff_t>(count_);
        const auto rank = static_cast<std::size_t>(share * static_cast<double>(count_));
        const auto nth = sorted.begin() + static_cast<std::ptrdiff_t>(std::min(rank, count_ - 1));
        std::nth_element(sorted.begin(), nth, last);
        return *nth;
    }
    /// What 95 of 100 replies take, once: when that has come near the response timeout (80 %), and
    /// again after it had gone back (60 %).
    std::optional<Duration> take_report(Duration timeout) {
        constexpr double kMost = 0.95;
        const Duration bar = timeout * (reported_ ? 6 : 8) / 10;
        const auto slow = static_cast<std::size_t>(
            std::count_if(samples_.begin(), samples_.begin() + static_cast<std::ptrdiff_t>(count_),
                          [&](Duration sample) { return sample >= bar; }));
        const bool is_near =
            known() && static_cast<double>(slow) >= (1 - kMost) * static_cast<double>(count_);
        if (std::exchange(reported_, is_near) || !is_near) return std::nullopt;
        return quantile(kMost);
    }

  private:
    std::array<Duration, kSamples> samples_{};
    std::size_t next_ = 0;
    std::size_t count_ = 0;
    bool reported_ = false;
};

/// How long after a timeout the reply may still come (T2): as configured, or one and a half times
/// the lateness seen, between one response timeout and eight. Pure.
class LateWindow {
  public:
    static constexpr int kForget =
        128;  ///< replies in time, after which the lateness loses a third

    LateWindow(std::optional<Duration> fixed, Duration response_timeout)
        : fixed_(fixed), timeout_(response_timeout) {}

    void apply(std::optional<Duration> fixed, Duration response_timeout) {
        *this = {fixed, std::max(timeout_, response_timeout), worst_};
    }
    Duration value() const {
        return fixed_.value_or(std::clamp(worst_ * 3 / 2, timeout_, 8 * timeout_));
    }
    /// A reply came this long after the timeout of its request.
    void on_late(Duration lateness) {
        worst_ = std::max(worst_, lateness);
        timely_ = 0;
    }
    void on_timely() {
        if (++timely_ % kForget == 0) worst_ = worst_ > 1ms ? worst_ * 2 / 3 : Duration{};
    }
    /// The longest lateness lately; 0: none.
    Duration worst() const { return worst_; }

  private:
    LateWindow(std::optional<Duration> fixed, Duration response_timeout, Duration worst)
        : fixed_(fixed), timeout_(response_timeout), worst_(worst) {}

    std::optional<Duration> fixed_;
    Duration timeout_;
    Duration worst_{};
    int timely_ = 0;
};

/// How long a station pauses inside its replies, where that is longer than the line's `reply_hole`
/// (T4). Two attempts in a row whose reply broke off show it, for one may be noise. Never longer
/// than the response timeout; forgotten when the station has not paused for a while. Pure.
class ReplyHole {
  public:
    /// An attempt failed whose reply broke off: after `pause` it went on, or was given up.
    void on_broken(TimePoint now, Duration pause, Duration most) {
        seen_ = std::max(seen_, pause);
        used_ = now;
        if (++broken_ >= 2) learned_ = std::min(seen_ * 5 / 4 + kMargin, most);
    }
    /// A reply came whole; the longest pause inside it.
    void on_reply(TimePoint now, Duration pause) {
        broken_ = 0;
        seen_ = {};
        if (2 * pause >= learned_) used_ = now;
        if (now >= used_ + timing::kForgetHole) learned_ = {};
    }
    /// 0: it does not pause for longer than the line.
    Duration learned() const { return learned_; }

  private:
    static constexpr Duration kMargin = 10ms;

    Duration learned_{};
    Duration seen_{};  ///< since the last whole reply
    int broken_ = 0;   ///< likewise
    TimePoint used_{};
};

/// What follows the replies of a station and would meet the next request: the reply once more
/// (T12), learned from the first one, or glitches of its transceiver (T3), learned from three of
/// eight replies. The line rests for a quarter longer than the latest took. Pure.
class Trail {
  public:
    /// `frame`: duration of a usual reply on this line; a copy ends that much later.
    explicit Trail(Duration frame = {}) : longest_(timing::kLongestTrail + frame) {}

    Duration longest() const { return longest_; }
    /// A reply ended.
    void on_reply(TimePoint now) {
        if (now >= copied_ + timing::kForgetCopies && std::popcount(followed_) == 0) delay_ = {};
        followed_ = static_cast<std::uint8_t>(followed_ << 1);
        at_ = now;
        if (listens_ && !seen_) vain_ = now;
        seen_ = false;
        listens_ = std::exchange(disturbs_, false);
    }
    /// What was asked at `started`, right behind its last reply, came to nothing but damage:
    /// the line listens once behind the next reply, unless it has lately done so in vain.
    void on_disturbed(TimePoint started) {
        const bool in_vain = vain_ != TimePoint{} && started < vain_ + timing::kForgetCopies;
        disturbs_ |= started <= at_ + longest_ && !in_vain;
    }
    /// Bytes that belong to no reply ended now, or a copy did.
    void on_followed(TimePoint now, bool is_copy) {
        const Duration delay = now - at_;
        if (delay <= Duration::zero() || delay > longest_) return;
        delay_ = std::max(delay_, delay);
        followed_ |= 1;
        if (is_copy) copied_ = now;
        seen_ = true;
    }
    /// Time until which the line should rest; in the past if nothing is expected.
    TimePoint until() const {
        if (seen_) return {};
        if (listens_) return at_ + longest_;
        return is_usual() ? at_ + rest() : TimePoint{};
    }
    /// From the end of a reply to the end of what follows it, and a margin; 0: usually nothing.
    Duration rest() const { return is_usual() ? delay_ * 5 / 4 : Duration{}; }
    /// True if its replies come twice.
    bool copies() const { return at_ < copied_ + timing::kForgetCopies && copied_ != TimePoint{}; }
    /// True if something has followed the last reply.
    bool seen() const { return seen_; }
    /// rest(), once: when something has come to follow its replies usually.
    std::optional<Duration> take_report() {
        if (reported_ || !is_usual()) return std::nullopt;
        reported_ = true;
        return rest();
    }

  private:
    static constexpr int kOften = 3;  ///< of the last eight replies: usually

    bool is_usual() const { return copies() || std::popcount(followed_) >= kOften; }

    Duration longest_;
    Duration delay_{};
    std::uint8_t followed_ = 0;  ///< by reply, the last one lowest
    TimePoint at_{};
    TimePoint copied_{};
    TimePoint vain_{};
    bool seen_ = false;
    bool disturbs_ = false;
    bool listens_ = false;
    bool reported_ = false;
};

}  // namespace panelgate::arbiter
