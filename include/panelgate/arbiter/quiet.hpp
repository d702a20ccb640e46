#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// When the line may be used: the last bit seen, the gap after it, and any further rest. Pure.
class Quiet {
  public:
    /// `longest`: duration of the longest frame. Bytes that continue longer than that, without even
    /// a pause of the standard gap, are no frame but a floating line, and nothing waits for their
    /// end (LAT-02).
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
        until_ = awaited_until_ = {};
        noise_ = {};
        begun_until_ = {};
    }
    /// An ASCII frame has begun, and its next character may come until then; TimePoint{}: it has
    /// ended.
    void on_begun(TimePoint until) { begun_until_ = until; }
    /// Bytes of a transaction were heard.
    void on_heard(TimePoint now) {
        since_ = std::max(since_, now);
        noise_ = {};
    }
    /// On a line that does not keep its rate, the reply came before our frame can have left.
    void on_answered_early(TimePoint now) { since_ = now; }
    /// Unsolicited bytes were heard.
    void on_noise(TimePoint now) {
        if (now >= since_ + pause_ || noise_ == TimePoint{}) noise_ = now;
        since_ = std::max(since_, now);
    }
    void rest_until(TimePoint until) { until_ = std::max(until_, until); }
    /// What is not for us is expected: another master's answer, or the trail of ours. Until then
    /// ...
    void await_until(TimePoint until) { awaited_until_ = std::max(awaited_until_, until); }
    /// ... or it has come.
    void has_come() { awaited_until_ = {}; }

    /// Earliest time for a frame that needs `gap` of silence before it.
    TimePoint free_at(Duration gap) const {
        const TimePoint silent = since_ + gap;
        const bool floats = noise_ != TimePoint{} && since_ - noise_ >= longest_;
        return std::max(
            {floats ? noise_ + longest_ : silent, until_, awaited_until_, begun_until_});
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
    TimePoint begun_until_{};
    TimePoint noise_{};  ///< first of the bytes that came without a pause
    TimePoint quarantined_until_{};
    TimePoint rested_until_{};  ///< accounted for by take_rested()
    std::uint8_t station_ = 0;
    std::uint8_t quarantined_ = 0;
};

/// Whether a line that is no real UART behaves like one: replies never begin before the request has
/// left, and bytes come no faster than the line's rate. One early reply disproves it until the line
/// is reopened, as does one that comes again whenever it is asked for again; after several in a row
/// the line does not keep its rate at all. Bytes that come too fast may have been delayed by a busy
/// sender: that must happen repeatedly, and is forgotten. Pure.
class Pace {
  public:
    void on_reply(bool early) {
        doubted_ = 0;
        in_time_ = early ? 0 : std::min(in_time_ + 1, kAgain);
        if (early) {
            kept_ = false;
            ++early_;
        } else {
            ++timely_;
            early_ = 0;
        }
    }
    /// An early reply was all that came.
    void on_doubted() { ++doubted_; }
    /// Asked again, the same came as the early one, or in time another one, where the early one was
    /// all that came and is no other request's as far as is known: `was_reply`, since values
    /// change. One alone proves neither.
    void on_asked_again(bool was_reply) {
        shown_ = std::clamp(shown_ + (was_reply ? 1 : -1), -kEnough, kEnough);
        if (shown_ < kEnough) return;
        kept_ = false;
        comes_early_ = true;
    }
    /// The reply came behind an early one, which was none: here are such.
    void on_followed() { shown_ = -kEnough; }
    /// `hasty`: bytes of a reply came faster than the line's rate allows.
    void on_rate(bool hasty) {
        hasty_ = hasty ? std::min(hasty_ + kWeight, kHasty * kWeight) : std::max(hasty_ - 1, 0);
    }
    /// True if nothing comes faster than the line's rate, except in one of kWeight replies.
    bool kept() const { return kept_ && hasty_ <= (kHasty - 1) * kWeight; }
    bool believed() const { return kept_ && timely_ >= kEnough; }
    /// True if an early frame is no reply, as far as the last ones show: then only asking again
    /// tells. Twice in a row nothing else came: it may be one.
    bool expects_none_early() const {
        return !comes_early_ && (believed() || in_time_ >= kAgain) && doubted_ < kDoubts;
    }
    /// True if the line does not keep its rate. A single early reply may be a late one to an
    /// earlier attempt.
    bool unbound() const { return early_ >= kEnough; }

  private:
    static constexpr int kEnough = 3;
    static constexpr int kHasty = 3;
    static constexpr int kAgain = 8;
    static constexpr int kDoubts = 2;
    static constexpr int kWeight = 8;

    int timely_ = 0;
    int early_ = 0;    // in a row
    int in_time_ = 0;  // in a row
    int doubted_ = 0;  // early ones in a row
    int shown_ = 0;    // early ones that were the reply, less those that were not
    bool kept_ = true;
    bool comes_early_ = false;
    int hasty_ = 0;  // +kWeight for each hasty reply, -1 for any other
};

}  // namespace panelgate::arbiter
