#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "panelgate/line/line.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::test {

/// A line in memory: every frame written is answered a little later, as a test says; what has come
/// lies in the device until somebody reads.
class MemoryLine final : public line::Line {
  public:
    explicit MemoryLine(rt::Clock& clock) : clock_(clock), answers_(clock.make_alarm()) {}

    void start(Events& events) override {
        events_ = &events;
        if (up_at_start) events.on_up();
    }
    void stop() override {
        answers_->cancel();
        events_ = nullptr;
    }
    void poll_input() override {
        ++polls;
        if (events_ == nullptr || device_.empty()) return;
        events_->on_bytes(std::exchange(device_, {}));
    }
    void write(ByteView bytes) override {
        written.emplace_back(bytes.begin(), bytes.end());
        if (fail_writes) {
            events_->on_down("unplugged");
            return;
        }
        if (reply.empty() || bytes[0] == 0) return;
        answers_->arm(clock_.now() + think, [this, adu = modbus::encode_adu(bytes[0], reply)] {
            come(adu);
            poll_input();
        });
    }
    const line::Counters& counters() override { return counters_; }
    std::optional<Duration> unsent() override {
        if (!tells_unsent) return std::nullopt;
        ++asked_for_unsent;
        return Duration::zero();
    }
    Events* events() { return events_; }

    /// It is in the device now, and nobody has been told.
    void come(ByteView bytes) { device_.insert(device_.end(), bytes.begin(), bytes.end()); }

    std::vector<Bytes> written;
    Bytes reply;  ///< the PDU; empty: silence
    Duration think = 1ms;
    bool up_at_start = true;
    bool fail_writes = false;
    bool tells_unsent = false;
    int asked_for_unsent = 0;
    int polls = 0;

  private:
    rt::Clock& clock_;
    std::unique_ptr<rt::Alarm> answers_;
    Events* events_ = nullptr;
    Bytes device_;
    line::Counters counters_;
};

}  // namespace panelgate::test
