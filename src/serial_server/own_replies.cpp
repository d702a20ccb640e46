#include "own_replies.hpp"

#include <algorithm>
#include <utility>

namespace panelgate::serial_server {

void OwnReplies::begin(EchoMode mode) {
    mode_ = mode;
    state_ = mode == EchoMode::on    ? EchoState::present
             : mode == EchoMode::off ? EchoState::absent
                                     : EchoState::unknown;
    sent_.clear();
    kept_.clear();
}

void OwnReplies::add(Bytes frame, bool is_distinct, TimePoint sure_until, TimePoint until) {
    sent_.push_back({std::move(frame), is_distinct, false, sure_until, until});
    if (sent_.size() > kMost) sent_.pop_front();
}

/// An echo that has come once may come again, and hides a repeated request once at most.
bool OwnReplies::is_echo(const Sent& sent, TimePoint now) const {
    return sent.is_distinct || now < sent.sure_until || state_ != EchoState::absent;
}

ByteView OwnReplies::hear(TimePoint now, std::uint8_t byte, bool starts) {
    released_.clear();
    if (kept_.empty() && !starts) {
        released_.push_back(byte);
        return released_;
    }
    kept_.push_back(byte);
    const auto ends = [&](const Sent& sent) { return sent.frame == kept_; };
    const auto whole = std::ranges::find_if(sent_, ends);
    if (whole == sent_.end()) {
        if (!begins_one()) released_ = release();
        return released_;
    }
    const bool echo = is_echo(*whole, now);
    const bool sure = whole->is_distinct || now < whole->sure_until;
    if (sure && mode_ == EchoMode::automatic) state_ = EchoState::present;
    // Those before it do not come any more; a request says nothing of them.
    sent_.erase(echo ? sent_.begin() : whole, whole + 1);
    if (echo) kept_.clear();
    released_ = release();
    return released_;
}

bool OwnReplies::begins_one() const {
    return std::ranges::any_of(sent_, [&](const Sent& sent) {
        return sent.frame.size() >= kept_.size() &&
               std::equal(kept_.begin(), kept_.end(), sent.frame.begin());
    });
}

Bytes OwnReplies::release() { return std::exchange(kept_, {}); }

void OwnReplies::disturb() {
    for (Sent& sent : sent_) sent.disturbed = true;
}

Bytes OwnReplies::expire(TimePoint now) {
    while (!sent_.empty() && now >= sent_.front().until) {
        const bool missing = kept_.empty() && !sent_.front().disturbed;
        if (missing && state_ == EchoState::unknown) state_ = EchoState::absent;
        sent_.pop_front();
    }
    return begins_one() ? Bytes{} : release();
}

std::optional<TimePoint> OwnReplies::next_deadline() const {
    if (sent_.empty()) return std::nullopt;
    return sent_.front().until;
}

}  // namespace panelgate::serial_server
