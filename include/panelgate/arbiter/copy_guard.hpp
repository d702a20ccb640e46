#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// Finds out that a station says its replies twice, or that two panels speak for one address, and
/// for how long after a reply the second one has to be waited for: it could pass for the answer to
/// a request of the same shape (P1). What repeats a reply to the letter is a copy at once; what
/// only has its shape has to come twice, for others speak as well. Forgotten when it stops. Pure.
class CopyGuard {
  public:
    static constexpr std::size_t kReplies = 8;
    static constexpr Duration kLongest = 500ms;  ///< later, it is something else

    void on_reply(TimePoint now, Bytes reply) {
        Slot& slot = slots_[next_++ % kReplies];
        slot = {};
        slot.at = now;
        slot.reply = std::move(reply);
    }
    /// It repeats a reply of the last moments to the letter.
    bool is_copy(TimePoint now, ByteView reply) const {
        return std::ranges::any_of(slots_, [&](const Slot& slot) {
            return slot.is_recent(now) && std::ranges::equal(reply, slot.reply);
        });
    }
    /// Of the shape of the reply taken last, and soon: perhaps another panel with the same address.
    bool is_second(TimePoint now, ByteView reply) const {
        const Slot& last = slots_[(next_ + kReplies - 1) % kReplies];
        return last.is_recent(now) && reply.size() == last.reply.size() &&
               reply[0] == last.reply[0];
    }
    /// A good frame that nobody asked for and nothing was owed for.
    void on_unasked(TimePoint now, ByteView reply) {
        for (Slot& slot : slots_) {
            if (!slot.is_recent(now) || !std::ranges::equal(reply, slot.reply)) continue;
            slot.copy = std::max(slot.copy, now - slot.at);
            return;
        }
        Slot& last = slots_[(next_ + kReplies - 1) % kReplies];
        if (is_second(now, reply)) last.second = std::max(last.second, now - last.at);
    }
    /// It has spoken twice lately.
    bool suspicious() const { return hold() > Duration::zero(); }
    /// How long after a reply the station is left alone.
    Duration hold() const {
        Duration copy{};
        Duration second{};
        int seconds = 0;
        for (const Slot& slot : slots_) {
            copy = std::max(copy, slot.copy);
            second = std::max(second, slot.second);
            seconds += slot.second > Duration::zero() ? 1 : 0;
        }
        return (seconds >= 2 ? std::max(copy, second) : copy) * 3 / 2;
    }

  private:
    struct Slot {
        TimePoint at{};
        Bytes reply;
        Duration copy{};    ///< behind it came the same once more
        Duration second{};  ///< ... or another one of its shape
        bool is_recent(TimePoint now) const { return !reply.empty() && now - at <= kLongest; }
    };
    std::array<Slot, kReplies> slots_{};
    std::size_t next_ = 0;
};

}  // namespace panelgate::arbiter
