#pragma once

#include <algorithm>
#include <deque>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::scenario {

/// Which of one station's requests its replies may be to, for anybody on the wire who takes it to
/// serve in order, and to be no later than its window. Each reply is read as that to the first
/// request that it fits: any other reading leaves fewer to the next ones. Where there is none, no
/// order explains what has come, and from then on order tells nothing.
class Order {
  public:
    void on_asked(TimePoint sent, ByteView pdu) {
        asked_.push_back({.at = sent, .pdu = Bytes(pdu.begin(), pdu.end())});
    }
    /// A reply came, which may be to what was asked within `window`. True if that can only be the
    /// request that was sent last, or an earlier attempt of the same.
    bool on_reply(TimePoint now, ByteView pdu, Duration window) {
        while (!asked_.empty() && asked_.front().at + window < now) asked_.pop_front();
        const bool is_copy = said_before(now, pdu);
        said_.push_back({.at = now, .pdu = Bytes(pdu.begin(), pdu.end())});
        const auto fits = [&](const Entry& one) { return modbus::answers(one.pdu, pdu); };
        const auto is_open = [&](const Entry& one) { return !one.over && fits(one); };
        const auto first = std::ranges::find_if(asked_, fits);
        const auto open = std::ranges::find_if(asked_, is_open);
        is_kept_ = is_kept_ && (is_copy || first != asked_.end());
        const bool is_last = open != asked_.end() && asked_.back().pdu == open->pdu &&
                             std::all_of(open, asked_.end(), [&](const Entry& one) {
                                 return !is_open(one) || one.pdu == open->pdu;
                             });
        if (open != asked_.end())
            std::for_each(asked_.begin(), open + 1, [](Entry& one) { one.over = true; });
        if (!is_copy && first != asked_.end()) asked_.erase(asked_.begin(), first + 1);
        return is_kept_ && is_last;
    }

  private:
    struct Entry {
        TimePoint at;
        Bytes pdu;
        bool over = false;  ///< it, or a later one, was answered by what may have been a copy
    };
    /// An adapter may keep its last frame: within a minute a reply may be an earlier one again, and
    /// then it answers nothing.
    bool said_before(TimePoint now, ByteView pdu) {
        constexpr Duration kLatestCopy = 60s;
        while (!said_.empty() && said_.front().at + kLatestCopy < now) said_.pop_front();
        return std::ranges::any_of(
            said_, [&](const Entry& one) { return std::ranges::equal(one.pdu, pdu); });
    }

    std::deque<Entry> asked_;  ///< behind the request that was answered last, by the time
    std::deque<Entry> said_;
    bool is_kept_ = true;  ///< as far as anybody can know
};

}  // namespace panelgate::scenario
