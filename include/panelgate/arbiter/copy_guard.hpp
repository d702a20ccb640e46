#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::arbiter {

/// Detects that a station sends its replies twice, or that two panels share one address, and how
/// long after a reply the second one must be awaited: it could pass for the answer to a request of
/// the same shape (P1). An exact repetition is a duplicate at once; a frame of the same shape must
/// occur twice, because other stations send too. Forgotten some minutes after it stopped. Pure.
class DuplicateGuard {
  public:
    static constexpr std::size_t kReplies = 8;
    static constexpr Duration kLongest = 500ms;  ///< a later frame is no duplicate
    static constexpr Duration kForget = 2min;
    static constexpr Duration kRepeatDelay =
        150ms;                                ///< some panels resend a damaged reply within this
    static constexpr int kConfirmations = 3;  ///< after which equal answers are trusted
    static constexpr int kDenials = 3;        ///< after which they count as duplicates

    void on_reply(TimePoint now, Bytes request, Bytes reply) {
        if (now - learned_at_ > kForget) learned_ = {};
        Slot& slot = slots_[next_++ % kReplies];
        slot = {};
        slot.at = now;
        slot.request = std::move(request);
        slot.reply = std::move(reply);
    }
    /// True if it repeats a recent reply exactly.
    bool is_duplicate(TimePoint now, ByteView reply) const {
        return earlier_reply_at(now, reply) != TimePoint{};
    }
    /// ... as soon as duplicates come from this station.
    bool repeats_itself(TimePoint now, ByteView reply) const {
        const TimePoint earlier = earlier_reply_at(now, reply);
        return earlier != TimePoint{} && now < earlier + 2 * settle_time();
    }
    /// True if it has the shape of the last reply and follows soon: perhaps another panel with the
    /// same address.
    bool is_second(TimePoint now, ByteView reply) const {
        const Slot& slot = last();
        return slot.is_recent(now) && reply.size() == slot.reply.size() &&
               reply[0] == slot.reply[0];
    }
    /// A good frame came that was neither requested nor outstanding.
    void on_unasked(TimePoint now, ByteView reply) {
        const TimePoint earlier = earlier_reply_at(now, reply);
        if (earlier != TimePoint{}) return learn(now, now - earlier);
        if (!is_second(now, reply)) return;
        slots_[last_index()].second = true;
        if (std::ranges::count_if(slots_, &Slot::second) >= 2) learn(now, now - last().at);
    }
    /// Returns a recent reply that occurs again, as a good frame, inside damaged bytes; or nullptr.
    const Bytes* duplicate_in(TimePoint now, std::uint8_t station, ByteView bytes,
                              modbus::CrcOrder order = modbus::CrcOrder::low_first) const {
        for (const Slot& slot : slots_) {
            if (!slot.is_recent(now)) continue;
            const Bytes earlier = modbus::encode_adu(station, slot.reply, order);
            if (!std::ranges::search(bytes, earlier).empty()) return &slot.reply;
        }
        return nullptr;
    }
    /// The frame repeats a recent reply, or is an outstanding one with the same values: it is
    /// ambiguous.
    void on_ambiguous(TimePoint now, ByteView reply) {
        const TimePoint earlier = earlier_reply_at(now, reply);
        if (earlier != TimePoint{}) on_doubt((now - earlier) * 3 / 2);
    }
    /// After the next reply the station rests for `wait`, once: a duplicate may follow.
    void on_doubt(Duration wait) { doubt_ = std::max(doubt_, wait); }
    /// True if the station has sent duplicates lately.
    bool known() const { return settle_time() > Duration::zero(); }
    /// True if this answer repeats the answer to another request, or, after a proven duplicate, any
    /// earlier one, and the station has not yet shown that it gives equal answers.
    bool suspicious(TimePoint now, ByteView request, ByteView reply) const {
        if (confirmed_[kind_of(request, reply)] >= kConfirmations) return false;
        const bool any = denied_ > 0 && now - denied_at_ <= kForget;
        return std::ranges::any_of(slots_, [&](const Slot& slot) {
            return slot.is_recent(now) && std::ranges::equal(reply, slot.reply) &&
                   (any || !std::ranges::equal(request, slot.request));
        });
    }
    /// True if this answer repeats a recent answer to another request.
    bool repeats_other(TimePoint now, ByteView request, ByteView reply) const {
        return std::ranges::any_of(slots_, [&](const Slot& slot) {
            return slot.is_recent(now) && std::ranges::equal(reply, slot.reply) &&
                   !std::ranges::equal(request, slot.request);
        });
    }
    /// The reply was no duplicate: a read had the same values when asked again; for any other
    /// request, which is not asked again, no other answer came.
    void on_confirmed(ByteView request, ByteView reply) {
        ++confirmed_[kind_of(request, reply)];
        denied_ = 0;
    }
    /// A reply at `at` repeated an earlier one, and the station answered differently when asked
    /// again. The value may have just changed: three times in a row it is a duplicate.
    void on_denied(TimePoint at, ByteView reply) {
        confirmed_ = {};
        denied_ = at - denied_at_ <= kForget ? denied_ + 1 : 1;
        denied_at_ = at;
        const TimePoint earlier = earlier_reply_at(at, reply);
        if (denied_ >= kDenials && earlier != TimePoint{}) learn(at, at - earlier);
    }
    /// With nothing outstanding, one request got this reply at `first` and again now: one of them
    /// is a duplicate, of the other or of an earlier reply.
    void on_repeated_reply(TimePoint now, TimePoint first, ByteView reply) {
        if (now - first > kLongest) return;
        const TimePoint earlier = earlier_reply_at(first, reply);
        learn(now,
              std::max(now - first, earlier == TimePoint{} ? Duration::zero() : first - earlier));
    }
    /// Time for which the station is not asked after a reply.
    Duration settle_time() const { return learned_ * 3 / 2; }
    /// ... after this reply, including the doubtful cases.
    Duration take_doubt() {
        return std::max(settle_time(), std::exchange(doubt_, Duration::zero()));
    }
    /// End of the rest after the last reply.
    TimePoint rest_until() const { return last().at + learned_ * 5 / 4; }

  private:
    struct Slot {
        TimePoint at{};
        Bytes request;
        Bytes reply;
        bool second = false;  ///< a frame of the same shape followed it
        bool is_recent(TimePoint now) const { return !reply.empty() && now - at <= kLongest; }
    };
    /// Values are trusted separately: two writes to one address have equal answers, and so do many
    /// exceptions.
    static std::size_t kind_of(ByteView request, ByteView reply) {
        return request[0] <= 4 && reply[0] == request[0] ? 0 : 1;
    }
    std::size_t last_index() const { return (next_ + kReplies - 1) % kReplies; }
    const Slot& last() const { return slots_[last_index()]; }
    /// When it last sent this reply; TimePoint{}: not recently.
    TimePoint earlier_reply_at(TimePoint now, ByteView reply) const {
        TimePoint earlier{};
        for (const Slot& slot : slots_) {
            if (slot.is_recent(now) && std::ranges::equal(reply, slot.reply))
                earlier = std::max(earlier, slot.at);
        }
        return earlier;
    }
    void learn(TimePoint now, Duration delay) {
        learned_ = std::max(learned_, delay);
        learned_at_ = now;
        confirmed_ = {};
    }

    std::array<Slot, kReplies> slots_{};
    std::size_t next_ = 0;
    std::array<int, 2> confirmed_{};  ///< by kind_of()
    TimePoint denied_at_{};
    int denied_ = 0;  ///< in a row
    Duration doubt_{};
    Duration learned_{};  ///< from a reply to its duplicate
    TimePoint learned_at_{};
};

}  // namespace panelgate::arbiter
