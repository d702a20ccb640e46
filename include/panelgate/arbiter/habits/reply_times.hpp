#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "panelgate/arbiter/book/timing.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// How long after a timeout a reply of one station may still come. Auto starts at the response
/// timeout, grows to one and a half times the lateness seen, at most to eight timeouts, and shrinks
/// again while replies are in time. Pure.
class LateWindow {
  public:
    static constexpr int kForget = 512;  ///< replies in time, after which it shrinks by a third

    LateWindow(std::optional<Duration> fixed, Duration response_timeout)
        : fixed_(fixed), timeout_(response_timeout), window_(response_timeout) {}

    /// The current window does not shrink.
    void apply(std::optional<Duration> fixed, Duration response_timeout) {
        fixed_ = fixed;
        timeout_ = response_timeout;
        window_ = std::max(window_, timeout_);
    }
    Duration value() const { return fixed_.value_or(window_); }
    Duration timeout() const { return timeout_; }
    /// A reply came this long after the timeout of its request.
    void on_late(Duration lateness) {
        worst_ = std::max(worst_, lateness);
        ever_ = true;
        ++late_;
        window_ = std::clamp(lateness * 3 / 2, window_, std::max(window_, 8 * timeout_));
        timely_ = 0;
    }
    void on_timely() {
        ++timely_;
        if (timely_ % kHabit == 0) late_ /= 2;
        if (late_ == 0) worst_ = {};
        if (timely_ < kForget) return;
        timely_ = 0;
        window_ = std::max(timeout_, window_ * 2 / 3);
    }
    /// True if one was late, however long ago.
    bool ever() const { return ever_; }
    /// Longest recent lateness; 0: the station is not late regularly.
    Duration worst() const { return late_ < 2 ? Duration::zero() : worst_; }

  private:
    static constexpr int kHabit = 64;  ///< replies in time, after which half of late_ is forgotten

    std::optional<Duration> fixed_;
    Duration timeout_;
    Duration window_;
    Duration worst_{};
    int timely_ = 0;
    int late_ = 0;  ///< recent late replies
    bool ever_ = false;
};

// When replies end, learned from reading at the expected end. One read in kLooks is meant to come
// too early, so that the idle time is known. Pure.

inline constexpr int kLooks = 8;

/// Time that this machine takes to notice that a reply has begun, and to wake up at its end.
class WakeLatency {
  public:
    static constexpr Duration kMost = 200us;

    /// Time by which a reply ends sooner than computed; negative: later.
    Duration early() const { return early_; }
    /// A reply was read that early. `whole`: all of it was there.
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
    static constexpr int kMost = 40'000;  ///< ppm: clocks that differ by 2 %, and a margin

    /// Time by which a reply of this duration at the line's rate ends sooner.
    Duration early(Duration reply) const { return reply * ppm_ / 1'000'000; }
    /// As WakeLatency::on_look(); a long reply counts more.
    void on_look(Duration reply, bool whole) {
        const int length = static_cast<int>(std::clamp<Duration>(reply, 1ms, 32ms) / 1ms);
        const int step = kStep * length;
        ppm_ = std::clamp(ppm_ + (whole ? step : (1 - kLooks) * step), -kMost, kMost);
    }

  private:
    static constexpr int kStep = 3;  ///< ppm per millisecond of reply

    int ppm_ = 0;
};

/// The shortest and the longest of recent times: at least of the last kWindow, at most of twice as
/// many. Pure.
class RecentTimes {
  public:
    static constexpr std::uint64_t kWindow = 256;
    static constexpr std::uint64_t kEnough = 16;  ///< fewer are not significant

    void add(Duration time) {
        newer_.shortest = std::min(newer_.shortest, time);
        newer_.longest = std::max(newer_.longest, time);
        if (++seen_ % kWindow == 0) older_ = std::exchange(newer_, {});
    }
    /// One that was selected for being long: it says nothing about how short they are.
    void add_long(Duration time) { newer_.longest = std::max(newer_.longest, time); }
    /// Empty if none was seen.
    std::optional<Duration> longest() const {
        const Duration longest = std::max(older_.longest, newer_.longest);
        return longest == Duration::min() ? std::nullopt : std::optional(longest);
    }
    std::optional<Duration> shortest() const {
        if (seen_ == 0) return std::nullopt;
        return std::min(older_.shortest, newer_.shortest);
    }
    /// True if a longer one than longest() is an exception, or a shorter one than shortest().
    /// `doubted`: it is in doubt by itself, and half as many show it.
    bool is_significant(bool doubted = false) const { return seen_ >= kEnough / (doubted ? 2 : 1); }
    /// Of few, all n, the next one may be longer with a chance of 1 / (n + 2): that share of
    /// `whole`.
    Duration share_of_few(Duration whole) const {
        return is_significant() ? Duration{} : whole / (static_cast<int>(seen_) + 2);
    }
    /// True if it is shorter than all by a quarter, and by more than the host may be late.
    bool is_far_below(Duration time, bool doubted = false) const {
        if (!is_significant(doubted)) return false;
        return time < *shortest() * 3 / 4 && *shortest() - time > timing::kReadingSlack;
    }

  private:
    struct Range {
        Duration shortest = Duration::max();
        Duration longest = Duration::min();
    };
    Range older_;
    Range newer_;
    std::uint64_t seen_ = 0;
};

/// Learns how long a station pauses inside its replies where that is longer than the line's
/// `reply_hole`. Two attempts in a row whose reply broke off show it (one may be noise); where they
/// have ended before it goes on, the next ones wait a quarter longer each. Never longer than the
/// response timeout; forgotten when it has not paused for kForgetHabit. Pure.
class ReplyHole {
  public:
    /// An attempt failed whose reply broke off: after `pause` it went on, or was given up.
    void on_broken(TimePoint now, Duration pause, Duration most) {
        seen_ = std::max(seen_, pause);
        used_ = now;
        if (++broken_ >= 2) learned_ = std::min(seen_ * 5 / 4 + timing::kCandidateMargin, most);
    }
    /// A reply came whole; the longest pause inside it.
    void on_reply(TimePoint now, Duration pause) {
        broken_ = 0;
        seen_ = {};
        if (2 * pause >= learned_) used_ = now;
        if (now >= used_ + timing::kForgetHabit) learned_ = {};
    }
    /// 0: it does not pause for longer than the line.
    Duration learned() const { return learned_; }

  private:
    Duration learned_{};
    Duration seen_{};  ///< since the last whole reply
    int broken_ = 0;   ///< likewise
    TimePoint used_{};
};

/// Learns what regularly follows the replies of one station (glitches of a transceiver that
/// releases the line, a duplicate) and how long it lasts: it would damage a request sent meanwhile.
/// Considers the last kReplies replies, so that it is soon unlearned. Pure.
class Trail {
  public:
    static constexpr std::size_t kReplies = 8;
    static constexpr int kOften = 3;  ///< of kReplies: regularly

    /// `frame`: duration of a usual reply on this line; a duplicate ends that much later.
    explicit Trail(Duration frame = {}) : longest_(timing::kLongestTrail + frame) {}

    Duration longest() const { return longest_; }
    /// A reply ended; records what followed the previous one.
    void on_reply(TimePoint now) {
        delays_[next_++ % kReplies] = last_;
        last_ = {};
        at_ = now;
        seen_ = false;
    }
    /// Unsolicited bytes were heard, the last one now.
    void on_unsolicited(TimePoint now) {
        const Duration delay = now - at_;
        if (delay <= Duration::zero() || delay > longest_) return;
        last_ = std::max(last_, delay);
        seen_ = true;
    }
    /// Time until which the line should rest; in the past if nothing is expected.
    TimePoint until() const { return seen_ ? TimePoint{} : at_ + settle_time(); }
    /// Time from the end of a reply to the end of what follows it; 0: usually nothing.
    Duration settle_time() const {
        const auto often =
            std::ranges::count_if(delays_, [](Duration delay) { return delay > Duration::zero(); });
        return often < kOften ? Duration::zero() : *std::ranges::max_element(delays_) * 5 / 4;
    }
    bool seen() const { return seen_; }
    /// The settle time, once: when something has come to follow its replies usually.
    std::optional<Duration> take_report() {
        if (reported_ || settle_time() == Duration::zero()) return std::nullopt;
        reported_ = true;
        return settle_time();
    }

  private:
    Duration longest_;
    std::array<Duration, kReplies> delays_{};
    std::size_t next_ = 0;
    Duration last_{};
    TimePoint at_{};
    bool seen_ = false;
    bool reported_ = false;
};

/// Recent think times of one station. Pure.
class Turnaround {
  public:
    static constexpr std::size_t kSamples = 64;
    static constexpr std::size_t kEnough = 8;

    void add(Duration think) {
        samples_[next_++ % kSamples] = think;
        count_ = std::min(count_ + 1, kSamples);
    }
    bool known() const { return count_ >= kEnough; }
    /// Of the last kSamples replies, `share` took at most this long; 0 < share <= 1.
    Duration quantile(double share) const {
        if (count_ == 0) return {};
        auto sorted = samples_;
        const auto last = sorted.begin() + static_cast<std::ptrdiff_t>(count_);
        const auto rank = static_cast<std::size_t>(share * static_cast<double>(count_));
        const auto nth = sorted.begin() + static_cast<std::ptrdiff_t>(std::min(rank, count_ - 1));
        std::nth_element(sorted.begin(), nth, last);
        return *nth;
    }

    /// True if quantile(share) >= bound. Requires at least one sample.
    bool reaches(double share, Duration bound) const {
        const auto rank = static_cast<std::size_t>(share * static_cast<double>(count_));
        const auto below = static_cast<std::size_t>(
            std::count_if(samples_.begin(), samples_.begin() + static_cast<std::ptrdiff_t>(count_),
                          [&](Duration sample) { return sample < bound; }));
        return below <= std::min(rank, count_ - 1);
    }
    /// What 95 of 100 replies take, once: when that has come near the response timeout (80 %), and
    /// again after it had gone back (60 %).
    std::optional<Duration> take_report(Duration timeout) {
        constexpr double kMost = 0.95;
        const bool is_near = known() && reaches(kMost, timeout * (reported_ ? 6 : 8) / 10);
        if (std::exchange(reported_, is_near) || !is_near) return std::nullopt;
        return quantile(kMost);
    }

  private:
    std::array<Duration, kSamples> samples_{};
    std::size_t next_ = 0;
    std::size_t count_ = 0;
    bool reported_ = false;
};

}  // namespace panelgate::arbiter
