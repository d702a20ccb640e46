#include "rts_sender.hpp"

#include <algorithm>
#include <utility>

#include "rs485.hpp"

namespace panelgate::line {
namespace {

/// For a driver that cannot report when the last bit has left: a USB adapter gets its bytes a USB
/// frame (1 ms) later, and begins after the next.
constexpr Duration kBlindMargin = 2ms;

}  // namespace

RtsSender::RtsSender(rt::Clock& clock, const Settings& settings, Owner owner, PortOps& ops)
    : clock_(clock),
      alarm_(clock.make_alarm()),
      settings_(settings),
      owner_(std::move(owner)),
      ops_(ops) {}

std::string RtsSender::opened(int fd, const Driver& driver) {
    closing();
    fd_ = fd;
    driver_ = driver;
    alive_ = std::make_shared<bool>(true);
    return switch_rts(fd_, settings_.rs485, false, ops_);
}

void RtsSender::closing() {
    if (alive_) *alive_ = false;
    alarm_->cancel();
    held_.clear();
    end_ = {};
}

void RtsSender::write(ByteView bytes) {
    held_.insert(held_.end(), bytes.begin(), bytes.end());
    if (!switch_to(true)) return;
    if (settings_.rs485.delay_before_send > Duration::zero()) {
        at(clock_.now() + settings_.rs485.delay_before_send, &RtsSender::send_pending);
    } else {
        send_pending();
    }
}

void RtsSender::send_pending() {
    const Bytes bytes = std::exchange(held_, {});
    const auto alive = alive_;
    owner_.send(bytes);
    if (!*alive) return;  // the write failed
    end_ = std::max(end_, clock_.now()) + wire_time(settings_.serial, bytes.size());
    const Duration margin = driver_.tells_empty ? Duration::zero() : kBlindMargin;
    at(end_ + margin + settings_.rs485.delay_after_send, &RtsSender::release);
}

void RtsSender::release() {
    const Duration left = unsent_time(fd_, driver_, character_time(settings_.serial), ops_);
    if (left > Duration::zero()) {
        at(clock_.now() + left + settings_.rs485.delay_after_send, &RtsSender::release);
    } else {
        switch_to(false);
    }
}

bool RtsSender::switch_to(bool sending) {
    const std::string error = switch_rts(fd_, settings_.rs485, sending, ops_);
    if (!error.empty()) owner_.failed(error);
    return error.empty();
}

void RtsSender::at(TimePoint when, void (RtsSender::*next)()) {
    alarm_->arm(when, [this, next] { (this->*next)(); });
}

}  // namespace panelgate::line
