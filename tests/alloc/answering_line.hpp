#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <utility>

#include "panel.hpp"
#include "panelgate/line/line.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::test {

/// A line whose panels answer everything well, after a while.
class AnsweringLine final : public line::Line {
  public:
    AnsweringLine(rt::Clock& clock, Duration think)
        : clock_(clock), think_(think), replied_(clock.make_alarm()) {}

    void start(Events& events) override {
        events_ = &events;
        events.on_up();
    }
    void stop() override {
        replied_->cancel();
        events_ = nullptr;
    }
    void poll_input() override {}
    void write(ByteView bytes) override {
        ++sent;
        reply_ = reply_to(bytes);
        replied_->arm(clock_.now() + think_, [this] { events_->on_bytes(reply_); });
    }
    const line::Counters& counters() override { return counters_; }

    std::uint64_t sent = 0;

  private:
    rt::Clock& clock_;
    Duration think_;
    std::unique_ptr<rt::Alarm> replied_;
    Events* events_ = nullptr;
    Bytes reply_;
    line::Counters counters_;
};

}  // namespace panelgate::test
