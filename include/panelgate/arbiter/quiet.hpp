#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// When the line may be used: the last bit seen on it, the gap behind that, and whatever else it
/// has to rest for. Pure.
class Quiet {
  public:
    /// `longest`: of a frame. Bytes without a pause, not even one as long as the standard's gap,
    /// for longer than that are no frame but a line that floats, and nobody has to wait for their
    /// end (LAT-02).
    Quiet(Duration longest, Duration pause) : longest_(longest), pause_(pause) {}

    /// The line was opened: one silent interval before the first frame (MST-01).
    void on_open(TimePoint now) {
        *this = Quiet(longest_, pause_);
        since_ = now;
        until_ = now;
    }
    /// Our frame leaves, its last bit at `end`; the gap of `station` follows it.
    void on_sent(TimePoint end, std::uint8_t station) {
        since_ = end;
        station_ = station;
        until_ = {};
        noise_ = {};
        begun_until_ = {};
    }
    /// A frame has begun by its first character (ASCII), and its next one may come until then; no
    /// time: it has ended.
    void on_begun(TimePoint until) { begun_until_ = until; }
    /// Something is heard that belongs to a transaction.
    void on_heard(TimePoint now) {
        since_ = std::max(since_, now);
        noise_ = {};
    }
    /// On a line that is not bound to its rate the reply came before our frame can have left.
    void on_answered_early(TimePoint now) { since_ = now; }
    /// Something is heard that nobody asked for.
    void on_noise(TimePoint now) {
        if (now >= since_ + pause_ || noise_ == TimePoint{}) noise_ = now;
        since_ = std::max(since_, now);
    }
    void rest_until(TimePoint until) { until_ = std::max(until_, until); }
    /// What the line rested for has come.
    void rest_is_over() { until_ = {}; }

    /// When a frame may follow that wants `gap` of silence in front.
    TimePoint free_at(Duration gap) const {
        const TimePoint silent = since_ + gap;
        const bool floats = noise_ != TimePoint{} && since_ - noise_ >= longest_;
        return std::max({floats ? noise_ + longest_ : silent, until_, begun_until_});
    }
    TimePoint since() const { return since_; }
    /// Whose gap follows the last bit: who was asked last.
    std::uint8_t station() const { return station_; }

    /// Nobody but `station` may be asked until then, and only for the same again (P1).
    void quarantine(TimePoint now, std::uint8_t station, TimePoint until) {
        if (until <= quarantined_until_) return;
        if (now >= quarantined_until_) rested_until_ = now;
        quarantined_ = station;
        quarantined_until_ = until;
    }
    /// What the station owed has come.
    void lift(TimePoint now, std::uint8_t station) {
        if (quarantined_ == station) quarantined_until_ = std::min(quarantined_until_, now);
    }
    /// So much of its quarantines has passed since it was asked last.
    Duration take_rested(TimePoint now) {
        const TimePoint until = std::min(now, quarantined_until_);
        return std::max(until - std::exchange(rested_until_, std::max(rested_until_, until)),
                        Duration::zero());
    }
    TimePoint quarantined_until() const { return quarantined_until_; }

  private:
    Duration longest_;
    Duration pause_;
    TimePoint since_{};
    TimePoint until_{};
    TimePoint begun_until_{};
    TimePoint noise_{};  ///< the first of the bytes that came without a pause
    TimePoint quarantined_until_{};
    TimePoint rested_until_{};  ///< what take_rested() has told
    std::uint8_t station_ = 0;
    std::uint8_t quarantined_ = 0;
};

/// Whether a line that is no real UART behaves like one: replies never begin before the request has
/// left, and no bytes come faster than the line's rate. One early reply settles it, until the line
/// is opened again; several early ones in a row, and the line is not bound to its rate at all.
/// Haste may be a sender that was held up by its machine: it has to happen again, and is forgotten.
/// Pure.
class Pace {
  public:
    void on_reply(bool early) {
        if (early) {
            kept_ = false;
            ++early_;
        } else {
            ++timely_;
            early_ = 0;
        }
    }
    /// Did bytes of a reply come sooner than the line's rate allows?
    void on_rate(bool hasty) {
        hasty_ = hasty ? std::min(hasty_ + kWeight, kHasty * kWeight) : std::max(hasty_ - 1, 0);
    }
    /// Nothing comes sooner than the line's rate allows, but for the odd one in kWeight replies.
    bool kept() const { return kept_ && hasty_ <= (kHasty - 1) * kWeight; }
    bool believed() const { return kept_ && timely_ >= kEnough; }
    /// One early reply may be a late one, to a request that was sent again.
    bool unbound() const { return early_ >= kEnough; }

  private:
    static constexpr int kEnough = 3;
    static constexpr int kHasty = 3;
    static constexpr int kWeight = 8;

    int timely_ = 0;
    int early_ = 0;  // in a row
    bool kept_ = true;
    int hasty_ = 0;  // a hasty one: kWeight; any other: 1 less
};

}  // namespace panelgate::arbiter
