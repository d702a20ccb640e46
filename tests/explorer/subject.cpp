#include "subject.hpp"

#include <algorithm>
#include <utility>
#include <variant>

namespace panelgate::explorer {

using arbiter::Action;
using arbiter::Finish;
using arbiter::Transmit;

void Subject::on_rx(TimePoint now, ByteView bytes) {
    constexpr Duration kSlow = 40ms;  // twice as long as those who answer at once are waited for
    now_ = now;
    heard_ = true;
    Bytes heard(bytes.begin(), bytes.end());
    const bool is_slow = missed_ && now >= sent_ + kSlow && bytes.size() > 1;
    if (flaw_ == Flaw::takes_no_slow_reply && is_slow) heard.back() ^= 1;
    arbiter_.on_rx(now, heard);
    arbiter_.check_invariants();
    constexpr Duration kSilence = 10ms;  // a reply that begins before it is heard
    const bool read = last_sent_.size() > 1 && last_sent_[1] == 3 && was_asked_for_;
    const bool echo =
        read && bytes.size() == 3 && std::equal(bytes.begin(), bytes.end(), last_sent_.begin());
    repeat_at_.reset();
    if (flaw_ == Flaw::repeats_at_partial_echo && echo) repeat_at_ = now + kSilence;
}

void Subject::on_deadline(TimePoint now) {
    now_ = now;
    if (repeat_at_ && now >= *repeat_at_) {
        repeat_at_.reset();
        waiting_.emplace_back(Transmit{last_sent_});
    }
    arbiter_.on_deadline(now);
    arbiter_.check_invariants();
}

void Subject::on_line_down(TimePoint now) {
    arbiter_.on_line_down(now);
    arbiter_.check_invariants();
    repeat_at_.reset();
    if (flaw_ == Flaw::forgets_at_line_loss) start_afresh();
}

/// Everything is answered; the next one knows nothing.
void Subject::start_afresh() {
    while (auto action = poll_arbiter()) waiting_.push_back(std::move(*action));
    arbiter_ = arbiter::Arbiter(*settings_);
    renamed_ = last_ticket_;
}

std::optional<Action> Subject::poll_arbiter() {
    auto action = arbiter_.poll_action();
    if (!action) return action;
    if (auto* finish = std::get_if<Finish>(&*action)) {
        finish->ticket += renamed_;
        ++finished_;
        if (flaw_ == Flaw::loses_an_answer && finished_ % 2 == 0) return poll_arbiter();
        if (flaw_ == Flaw::answers_twice) waiting_.emplace_back(*finish);
    } else if (const auto* transmit = std::get_if<Transmit>(&*action)) {
        last_sent_ = transmit->adu;
        sent_ = now_;
        missed_ = missed_ || !std::exchange(heard_, false);
        if (flaw_ == Flaw::sends_twice) waiting_.emplace_back(*transmit);
    } else if (const auto* note = std::get_if<arbiter::Note>(&*action)) {
        if (direction_of(note->kind) == FrameDirection::sent)
            was_asked_for_ = note->kind != FrameKind::probe;
    }
    return action;
}

std::optional<Action> Subject::poll_action() {
    if (!waiting_.empty()) {
        Action action = std::move(waiting_.front());
        waiting_.erase(waiting_.begin());
        return action;
    }
    return poll_arbiter();
}

std::optional<TimePoint> Subject::next_deadline() const {
    const auto next = arbiter_.next_deadline();
    if (flaw_ == Flaw::spins && next) return TimePoint{};
    if (!repeat_at_) return next;
    return next ? std::min(*next, *repeat_at_) : *repeat_at_;
}

}  // namespace panelgate::explorer
