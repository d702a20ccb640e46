#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <utility>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// How long after a timeout a reply of one station may still come. Auto starts at the response
/// timeout, grows to one and a half times the lateness seen, at most to eight timeouts, and shrinks
/// again while replies come in time: one that was late once is no reason to wait for ever. Pure.
class LateWindow {
  public:
    static constexpr int kForget = 512;  ///< replies in time, after which it shrinks by a third

    LateWindow(std::optional<Duration> fixed, Duration response_timeout)
        : fixed_(fixed), timeout_(response_timeout), window_(response_timeout) {}

    /// What has grown does not shrink by that.
    void apply(std::optional<Duration> fixed, Duration response_timeout) {
        fixed_ = fixed;
        timeout_ = response_timeout;
        window_ = std::max(window_, timeout_);
    }
    Duration value() const { return fixed_.value_or(window_); }
    /// A reply came this long after the timeout of its request.
    void on_late(Duration lateness) {
        worst_ = std::max(worst_, lateness);
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
    /// The longest lateness seen lately; 0: to be late is no habit of this station.
    Duration worst() const { return late_ < 2 ? Duration::zero() : worst_; }

  private:
    static constexpr int kHabit = 64;  ///< replies in time, after which half is forgiven

    std::optional<Duration> fixed_;
    Duration timeout_;
    Duration window_;
    Duration worst_{};
    int timely_ = 0;
    int late_ = 0;  ///< replies, lately
};

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

/// The longest of what was seen lately: what a network did once is no reason to wait for ever.
/// Pure.
class Slowest {
  public:
    static constexpr int kWindow = 256;  ///< of the last so many all count; of two windows at most

    void add(Duration seen) {
        newer_ = std::max(newer_, seen);
        if (++count_ < kWindow) return;
        count_ = 0;
        older_ = std::exchange(newer_, Duration::min());
    }
    /// Nothing: none was seen.
    std::optional<Duration> value() const {
        const Duration longest = std::max(older_, newer_);
        return longest == Duration::min() ? std::nullopt : std::optional(longest);
    }

  private:
    Duration older_ = Duration::min();
    Duration newer_ = Duration::min();
    int count_ = 0;
};

/// The shortest, likewise. Pure.
class Quickest {
  public:
    static constexpr int kEnough = 16;  ///< fewer tell nothing of what is too quick

    void add(Duration seen) {
        slowest_.add(-seen);
        count_ = std::min(count_ + 1, kEnough);
    }
    /// Nothing: none was seen.
    std::optional<Duration> value() const {
        const auto longest = slowest_.value();
        return longest ? std::optional(-*longest) : std::nullopt;
    }
    bool known() const { return count_ >= kEnough; }

  private:
    Slowest slowest_;
    int count_ = 0;
};

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
