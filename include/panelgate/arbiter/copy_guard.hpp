#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::arbiter {

/// Finds out that a station says its replies twice, or that two panels speak for one address, and
/// for how long after a reply the second one has to be waited for: it could pass for the answer to
/// a request of the same shape (P1). What repeats a reply to the letter is a copy at once; what
/// only has its shape has to come twice, for others speak as well. Forgotten some minutes after it
/// stopped. Pure.
class CopyGuard {
  public:
    static constexpr std::size_t kReplies = 8;
    static constexpr Duration kLongest = 500ms;  ///< later, it is something else
    static constexpr Duration kForget = 2min;
    static constexpr Duration kSaidAgain = 150ms;  ///< behind a damaged reply, by some panels
    static constexpr int kConfirmations = 3;       ///< that make equal answers credible
    static constexpr int kDenials = 3;             ///< that make them copies

    void on_reply(TimePoint now, Bytes request, Bytes reply) {
        if (now - learned_at_ > kForget) learned_ = {};
        Slot& slot = slots_[next_++ % kReplies];
        slot = {};
        slot.at = now;
        slot.request = std::move(request);
        slot.reply = std::move(reply);
    }
    /// It repeats a reply of the last moments to the letter.
    bool is_copy(TimePoint now, ByteView reply) const { return said_at(now, reply) != TimePoint{}; }
    /// ... so soon as copies come from this station.
    bool repeats_itself(TimePoint now, ByteView reply) const {
        const TimePoint said = said_at(now, reply);
        return said != TimePoint{} && now < said + 2 * hold();
    }
    /// Of the shape of the reply taken last, and soon: perhaps another panel with the same address.
    bool is_second(TimePoint now, ByteView reply) const {
        const Slot& slot = last();
        return slot.is_recent(now) && reply.size() == slot.reply.size() &&
               reply[0] == slot.reply[0];
    }
    /// A good frame that nobody asked for and nothing was owed for.
    void on_unasked(TimePoint now, ByteView reply) {
        const TimePoint said = said_at(now, reply);
        if (said != TimePoint{}) return learn(now, now - said);
        if (!is_second(now, reply)) return;
        slots_[last_index()].second = true;
        if (std::ranges::count_if(slots_, &Slot::second) >= 2) learn(now, now - last().at);
    }
    /// A recent reply that stands once more, as a good frame, amid bytes that are none; or nullptr.
    const Bytes* copy_in(TimePoint now, std::uint8_t station, ByteView bytes,
                         modbus::CrcOrder order = modbus::CrcOrder::low_first) const {
        for (const Slot& slot : slots_) {
            if (!slot.is_recent(now)) continue;
            const Bytes said = modbus::encode_adu(station, slot.reply, order);
            if (!std::ranges::search(bytes, said).empty()) return &slot.reply;
        }
        return nullptr;
    }
    /// This is a recent reply once more, or one that was owed and has the same values: nobody can
    /// tell.
    void on_either(TimePoint now, ByteView reply) {
        const TimePoint said = said_at(now, reply);
        if (said != TimePoint{}) on_doubt((now - said) * 3 / 2);
    }
    /// Behind the next reply the station rests for so long, once: its copy may follow.
    void on_doubt(Duration wait) { doubt_ = std::max(doubt_, wait); }
    /// It has spoken twice lately.
    bool known() const { return hold() > Duration::zero(); }
    /// This answer repeats that to another request, or, where one that did was no answer to it, any
    /// earlier one; and the station has not shown yet that it gives equal ones.
    bool suspicious(TimePoint now, ByteView request, ByteView reply) const {
        if (confirmed_[kind_of(request, reply)] >= kConfirmations) return false;
        const bool any = denied_ > 0 && now - denied_at_ <= kForget;
        return std::ranges::any_of(slots_, [&](const Slot& slot) {
            return slot.is_recent(now) && std::ranges::equal(reply, slot.reply) &&
                   (any || !std::ranges::equal(request, slot.request));
        });
    }
    /// This answer repeats that to another request of the last moments.
    bool repeats_other(TimePoint now, ByteView request, ByteView reply) const {
        return std::ranges::any_of(slots_, [&](const Slot& slot) {
            return slot.is_recent(now) && std::ranges::equal(reply, slot.reply) &&
                   !std::ranges::equal(request, slot.request);
        });
    }
    /// It was no copy: a read had the same values when it was asked once more; behind anything
    /// else, which is not asked twice, no other answer came.
    void on_confirmed(ByteView request, ByteView reply) {
        ++confirmed_[kind_of(request, reply)];
        denied_ = 0;
    }
    /// What came at `at` repeated an earlier reply, and when it was asked once more the station
    /// said something else. That may be a value that has just changed: three times in a row it is
    /// a copy.
    void on_denied(TimePoint at, ByteView reply) {
        confirmed_ = {};
        denied_ = at - denied_at_ <= kForget ? denied_ + 1 : 1;
        denied_at_ = at;
        const TimePoint said = said_at(at, reply);
        if (denied_ >= kDenials && said != TimePoint{}) learn(at, at - said);
    }
    /// It was asked once, owed nothing, and said this at `first` and again: whichever was the
    /// answer, one of them is a copy, of the other or of what it had said before.
    void on_said_twice(TimePoint now, TimePoint first, ByteView reply) {
        if (now - first > kLongest) return;
        const TimePoint said = said_at(first, reply);
        learn(now, std::max(now - first, said == TimePoint{} ? Duration::zero() : first - said));
    }
    /// How long after a reply the station is left alone.
    Duration hold() const { return learned_ * 3 / 2; }
    /// ... after this one, for what is in doubt too.
    Duration take_doubt() { return std::max(hold(), std::exchange(doubt_, Duration::zero())); }
    /// Behind the reply taken last: until then.
    TimePoint rest_until() const { return last().at + learned_ * 5 / 4; }

  private:
    struct Slot {
        TimePoint at{};
        Bytes request;
        Bytes reply;
        bool second = false;  ///< behind it came another one of its shape
        bool is_recent(TimePoint now) const { return !reply.empty() && now - at <= kLongest; }
    };
    /// Values are believed by themselves: two writes to one place have the same answer, and what is
    /// refused is often refused alike.
    static std::size_t kind_of(ByteView request, ByteView reply) {
        return request[0] <= 4 && reply[0] == request[0] ? 0 : 1;
    }
    std::size_t last_index() const { return (next_ + kReplies - 1) % kReplies; }
    const Slot& last() const { return slots_[last_index()]; }
    /// When it said this last; the beginning of time: not lately.
    TimePoint said_at(TimePoint now, ByteView reply) const {
        TimePoint said{};
        for (const Slot& slot : slots_) {
            if (slot.is_recent(now) && std::ranges::equal(reply, slot.reply))
                said = std::max(said, slot.at);
        }
        return said;
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
    Duration learned_{};  ///< from a reply to its second copy
    TimePoint learned_at_{};
};

}  // namespace panelgate::arbiter
