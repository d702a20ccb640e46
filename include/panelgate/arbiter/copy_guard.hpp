#pragma once

#include <algorithm>
#include <utility>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// Finds out that a station says its replies twice, and for how long after a reply the second copy
/// has to be waited for: it could pass for the answer to a request of the same shape (P1). Pure.
class CopyGuard {
  public:
    void on_reply(TimePoint now, Bytes reply) {
        before_ = at_;
        at_ = now;
        reply_ = std::move(reply);
        if (++replies_ > kForget) hold_ = {};
    }
    /// A good frame of the station that nothing was owed for. When it is not the copy of the reply
    /// taken last, then that one was a copy, and this is the reply.
    void on_unasked(TimePoint now, ByteView reply) {
        const bool copy = std::ranges::equal(reply, reply_);
        const Duration delay = now - (copy ? at_ : before_);
        if (delay > kLongest) return;
        replies_ = 0;
        hold_ = std::max(hold_, delay * 3 / 2);
    }
    /// Looks like the second copy of the reply taken last, perhaps of another panel with the same
    /// address and other values.
    bool is_second(TimePoint now, ByteView reply) const {
        return !reply_.empty() && reply.size() == reply_.size() && reply[0] == reply_[0] &&
               now - at_ <= kLongest;
    }
    /// How long after a reply the station is left alone.
    Duration hold() const { return hold_; }

  private:
    static constexpr int kForget = 1000;         ///< replies without a copy
    static constexpr Duration kLongest = 500ms;  ///< later, it is something else

    TimePoint at_{};
    TimePoint before_{};
    Bytes reply_;
    Duration hold_{};
    int replies_ = 0;
};

}  // namespace panelgate::arbiter
