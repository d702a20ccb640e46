#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// Finds out that a station says its replies twice, and for how long after a reply the second copy
/// has to be waited for: it could pass for the answer to a request of the same shape (P1). Only
/// what repeats the reply to the letter is a copy; it is forgotten when copies stop coming. Pure.
class CopyGuard {
  public:
    static constexpr std::size_t kReplies = 8;
    static constexpr Duration kLongest = 500ms;  ///< later, it is something else

    void on_reply(TimePoint now, Bytes reply) {
        delays_[next_++ % kReplies] = last_;
        last_ = {};
        before_ = std::exchange(at_, now);
        repeated_ = reply == reply_ && now - before_ <= kLongest;
        reply_ = std::move(reply);
    }
    /// It repeats the reply taken last, to the letter and soon.
    bool is_copy(TimePoint now, ByteView reply) const {
        return !reply_.empty() && now - at_ <= kLongest && std::ranges::equal(reply, reply_);
    }
    /// Of the shape of the reply taken last, and soon: perhaps another panel with the same address.
    bool is_second(TimePoint now, ByteView reply) const {
        return !reply_.empty() && now - at_ <= kLongest && reply.size() == reply_.size() &&
               reply[0] == reply_[0];
    }
    /// A good frame that nobody asked for and nothing was owed for. True when it tells that this
    /// station speaks twice: it is a copy, or it is what the reply taken last should have been,
    /// because that one was a copy itself.
    bool on_unasked(TimePoint now, ByteView reply) {
        if (is_copy(now, reply)) {
            last_ = std::max(last_, now - at_);
            return true;
        }
        const bool late_for_copy = repeated_ && is_second(now, reply);
        if (late_for_copy) last_ = std::max(last_, now - before_);
        return late_for_copy;
    }
    /// How long after a reply the station is left alone.
    Duration hold() const { return std::max(last_, *std::ranges::max_element(delays_)) * 3 / 2; }

  private:
    std::array<Duration, kReplies> delays_{};
    std::size_t next_ = 0;
    Duration last_{};  ///< behind the reply taken last
    TimePoint at_{};
    TimePoint before_{};
    Bytes reply_;
    bool repeated_ = false;  ///< the reply taken last is the one before, to the letter
};

}  // namespace panelgate::arbiter
