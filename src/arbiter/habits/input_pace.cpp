#include "panelgate/arbiter/habits/input_pace.hpp"
#include "panelgate/arbiter/book/timing.hpp"

#include <algorithm>

namespace panelgate::arbiter {

std::optional<InputPace::Look> InputPace::look(std::size_t missing, bool end) const {
    if (!is_kept() || missing == 0) return std::nullopt;
    Look next;
    next.reply = (since_ + missing) * line_.byte;
    next.end = end;
    next.at = *began_ + next.reply;
    const Duration early = line_.wake_latency + line_.drift.early(next.reply);
    if (end) next.at -= std::min(early, next.reply / 4);  // or a short one could not be judged
    return next;
}

TimePoint InputPace::busy_until(const Look& next) const {
    return std::min(next.at, looked_ + std::max(timing::kLongestLook, looked_ - *began_));
}

void InputPace::on_read(TimePoint now, std::size_t bytes) {
    since_ += bytes;
    looked_ = now;
    hasty_ = hasty_ || (began_ && latest(now) < *began_ - slack());
    began_ = began_ ? std::min(*began_, latest(now)) : latest(now);
}

void InputPace::restart(TimePoint now, std::size_t rest) {
    since_ = rest;
    began_.reset();
    if (since_ > 0) began_ = latest(now);
}

void InputPace::on_judged(TimePoint now, const std::optional<Look>& planned, bool replied) {
    if (!planned || !planned->end || now < planned->at || end_look_) return;
    const bool whole = since_ * line_.byte >= planned->reply;
    shorter_ = replied && !whole;
    if (!shorter_) end_look_ = {planned->reply, whole};
}

void InputPace::drop_if_late(TimePoint now, const std::optional<TimePoint>& busy) {
    if (began_ && (latest(now) > *began_ + slack() || (busy && *busy <= now))) began_.reset();
}

}  // namespace panelgate::arbiter
