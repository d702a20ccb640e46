// New settings for a bus that runs, with or without another line.
#include <boost/asio/post.hpp>
#include <memory>
#include <optional>
#include <utility>

#include "bus_state.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::bus {

namespace asio = boost::asio;

void Bus::State::apply(Settings next, std::unique_ptr<line::Line> other,
                       std::shared_ptr<void> far_end) {
    health_events.on_change(next.stations);
    if (other) {
        if (!change) change.emplace(Change{{}, nullptr, {}, false});
        change->line = std::move(other);
        change->far_ends.push_back(std::move(far_end));
        arbiter.suspend();
    }
    if (change) {
        change->settings = std::move(next);
        return schedule_line_change();
    }
    adopt(std::move(next));
    drive.tell([this](TimePoint now) {
        arbiter.apply(settings.arbiter);
        deny_forbidden(now);
    });
}

void Bus::State::deny_forbidden(TimePoint now) {
    arbiter.deny(now, [this](const arbiter::Job& job) {
        const auto entry = pending.find(job.ticket);
        if (entry == pending.end()) return false;
        std::optional<Refusal> denial = judge_again(job, entry->second);
        if (!denial) return false;
        if (job.attempts > 0) return true;  // sent: no refusal, but it is not sent again
        entry->second.denial = std::make_unique<Refusal>(std::move(*denial));
        return true;
    });
}

std::optional<Refusal> Bus::State::judge_again(const arbiter::Job& job,
                                               const Pending& entry) const {
    std::optional<modbus::Request> asked;
    if (entry.sent_as != 0) {
        auto original = modbus::Request::make(entry.original_pdu, modbus::QuantityCheck::wide);
        if (original) asked = std::move(*original);
    }
    auto refusal = judge(job.who, {.station = job.station,
                                   .asked = asked ? &*asked : &job.request,
                                   .sent = asked ? &job.request : nullptr,
                                   .raw = job.raw});
    if (refusal || job.request.is_read()) return refusal;
    return rights.judge_write(job.station);
}

void Bus::State::adopt(Settings next) {
    settings = std::move(next);
    rights = Rights(settings.stations, settings.access);
    account.apply();
    departed.apply(settings.clients);
    doctor.apply();
}

/// Posted: the line may be the caller, and must not be replaced during its own call.
void Bus::State::schedule_line_change() {
    if (!change || change->posted || arbiter.is_waiting()) return;
    change->posted = true;
    asio::post(executor, [this, life = std::weak_ptr(alive)] {
        if (!life.expired()) change_line();
    });
}

void Bus::State::change_line() {
    if (!change) return;
    change->posted = false;
    if (arbiter.is_waiting()) return;
    Change made = std::move(*change);
    change.reset();
    call([&] {
        line->stop();
        take_down("its settings have changed, and it is being opened",
                  [this] { drive.hear([this](TimePoint) { arbiter.on_line_left(); }); });
        adopt(std::move(made.settings));
        line = std::move(made.line);
        drive.use(*line);
        drive.hear([this](TimePoint now) {
            arbiter.apply(settings.arbiter);
            deny_forbidden(now);
        });
        line->start(*this);
    });
}

}  // namespace panelgate::bus
