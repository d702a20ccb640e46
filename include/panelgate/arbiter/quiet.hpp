#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// When the line may be used: the last bit seen, the gap after it, and any further rest. Pure.
class Quiet {
  public:
    /// `longest`: duration of the longest frame. Bytes that continue longer, without a pause of the
    /// standard gap, are a floating line, and nothing waits for their end (LAT-02).
    Quiet(Duration longest, Duration pause) : longest_(longest), pause_(pause) {}

    /// The line was opened: one silent interval before the first frame (MST-01).
    void on_open(TimePoint now) {
        *this = Quiet(longest_, pause_);
        since_ = now;
        until_ = now;
    }
    /// Our frame leaves, its last bit at `end`; the gap of `station` follows.
    void on_sent(TimePoint end, std::uint8_t station) {
        since_ = end;
        station_ = station;
        until_ = awaited_until_ = trail_until_ = {};
        noise_ = {};
        begun_until_ = {};
    }
    /// An ASCII frame's next character may come until then; TimePoint{}: it has ended.
    void on_begun(TimePoint until) { begun_until_ = until; }
    /// Bytes of a transaction were heard.
    void on_heard(TimePoint now) {
        since_ = std::max(since_, now);
        noise_ = {};
    }
    /// The reply came before our frame can have left (T7): the gap follows the reply.
    void on_answered_early(TimePoint now) { since_ = now; }
    /// Unsolicited bytes were heard.
    void on_noise(TimePoint now) {
        if (now >= since_ + pause_ || noise_ == TimePoint{}) noise_ = now;
        since_ = std::max(since_, now);
    }
    void rest_until(TimePoint until) { until_ = std::max(until_, until); }
    /// Another master's answer is expected until then, or until the answer has come (T9).
    void await_until(TimePoint until) { awaited_until_ = std::max(awaited_until_, until); }
    void has_come() { awaited_until_ = {}; }
    /// The trail of our own answer is expected until then, or until the trail has come (T12).
    void trail_until(TimePoint until) { trail_until_ = std::max(trail_until_, until); }
    void trail_has_come() { trail_until_ = {}; }

    /// Earliest time for a frame that needs `gap` of silence before it.
    TimePoint free_at(Duration gap) const {
        const TimePoint silent = since_ + gap;
        const bool floats = noise_ != TimePoint{} && since_ - noise_ >= longest_;
        return std::max({floats ? noise_ + longest_ : silent, until_, awaited_until_, trail_until_,
                         begun_until_});
    }
    TimePoint since() const { return since_; }
    /// The station asked last, whose gap follows the last bit.
    std::uint8_t station() const { return station_; }

    /// Until then only `station` may be asked, and only for the same again (P1).
    void quarantine(TimePoint now, std::uint8_t station, TimePoint until) {
        if (until <= quarantined_until_) return;
        if (now >= quarantined_until_) rested_until_ = now;
        quarantined_ = station;
        quarantined_until_ = until;
    }
    /// The station's outstanding replies have come.
    void lift(TimePoint now, std::uint8_t station) {
        if (quarantined_ == station) quarantined_until_ = std::min(quarantined_until_, now);
    }
    /// Quarantine time that has passed since the last call.
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
    TimePoint awaited_until_{};
    TimePoint trail_until_{};
    TimePoint begun_until_{};
    TimePoint noise_{};  ///< first of the bytes that came without a pause
    TimePoint quarantined_until_{};
    TimePoint rested_until_{};  ///< accounted for by take_rested()
    std::uint8_t station_ = 0;
    std::uint8_t quarantined_ = 0;
};

}  // namespace panelgate::arbiter
