#include <boost/asio/post.hpp>
#include <utility>

#include "bus_state.hpp"

namespace panelgate::bus {

namespace asio = boost::asio;

void Bus::State::apply(Settings next, std::unique_ptr<line::Line> other,
                       std::shared_ptr<void> far_end) {
    if (other) {
        if (!change) change.emplace(Change{{}, nullptr, {}, false});
        change->line = std::move(other);
        change->far_ends.push_back(std::move(far_end));
        arbiter.hold();
    }
    if (change) {
        change->settings = std::move(next);
        return change_soon();
    }
    take(std::move(next));
    drive.tell([this](TimePoint now) {
        arbiter.apply(settings.arbiter);
        deny_what_is_forbidden(now);
    });
}

void Bus::State::deny_what_is_forbidden(TimePoint now) {
    arbiter.deny(now, [this](const arbiter::Job& job) {
        return !job.request.is_read() && rights.judge_write(job.station);
    });
}

void Bus::State::take(Settings next) {
    settings = std::move(next);
    rights = Rights(settings.stations);
    account.apply();
    departed.apply(settings.clients);
    doctor.apply();
}

/// Not from inside the line that is to go.
void Bus::State::change_soon() {
    if (!change || change->due || arbiter.is_waiting()) return;
    change->due = true;
    asio::post(executor, [this, life = std::weak_ptr(alive)] {
        if (!life.expired()) change_line();
    });
}

void Bus::State::change_line() {
    if (!change) return;
    change->due = false;
    if (arbiter.is_waiting()) return;
    Change made = std::move(*change);
    change.reset();
    call([&] {
        line->stop();
        if (std::exchange(up, false)) book.on_line_down(clock.now());
        why_down = "its settings have changed, and it is being opened";
        take(std::move(made.settings));
        line = std::move(made.line);
        drive.use(*line);
        drive.hear([this](TimePoint now) {
            arbiter.on_line_left();
            arbiter.apply(settings.arbiter);
            deny_what_is_forbidden(now);
        });
        line->start(*this);
    });
}

}  // namespace panelgate::bus
