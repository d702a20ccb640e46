#include "shared.hpp"

#include <utility>

namespace panelgate::tcp_server {

OwnAnswers::OwnAnswers(rt::Clock& clock, std::size_t most, Duration period)
    : clock_(clock), most_(most), period_(period), next_(clock.make_alarm()) {}

bool OwnAnswers::try_acquire() {
    begin_period();
    if (!waiting_.empty() || given_ >= most_) return false;
    ++given_;
    return true;
}

void OwnAnswers::wait(Give give) {
    waiting_.push_back(std::move(give));
    if (waiting_.size() == 1) arm();
}

void OwnAnswers::begin_period() {
    const TimePoint now = clock_.now();
    if (now < end_) return;
    end_ = now + period_;
    given_ = 0;
}

/// A give() may queue another answer, which waits behind the answers queued before.
void OwnAnswers::serve_waiting() {
    begin_period();
    while (!waiting_.empty() && given_ < most_) {
        const Give give = std::move(waiting_.front());
        waiting_.pop_front();
        if (give()) ++given_;
    }
    if (!waiting_.empty()) arm();
}

void OwnAnswers::arm() {
    next_->arm(end_, [weak = weak_from_this()] {
        if (const auto self = weak.lock()) self->serve_waiting();
    });
}

void Shared::log(rt::LogLevel level, std::string_view event, std::vector<rt::LogField> more) const {
    more.insert(more.begin(), rt::LogField{"listener", counters.listener});
    rt::log(level, event, more);
}

}  // namespace panelgate::tcp_server
