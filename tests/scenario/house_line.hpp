#pragma once

#include <functional>
#include <string>

#include "agenda.hpp"
#include "panelgate/line/line.hpp"
#include "random.hpp"
#include "wire.hpp"

namespace panelgate::scenario {

/// The gateway's end of the wire. What has come lies in the device until the loop wakes and reads,
/// or the driver reads before.
class HouseLine final : public line::Line {
  public:
    /// As soon as the process runs.
    using Reach = std::function<void(std::function<void()>)>;

    /// `wake`: how much later the loop looks, at most. All of them outlive it.
    HouseLine(Agenda& agenda, Wire& wire, Random& random, Duration wake, Reach reach)
        : agenda_(agenda), wire_(wire), random_(random), wake_(wake), reach_(std::move(reach)) {}

    void start(Events& events) override;
    void stop() override { events_ = nullptr; }
    void poll_input() override {
        if (!deaf) read();
    }
    void defer_input(bool hold) override {
        held_ = hold;
        if (!hold && !device_.empty()) wake();
    }
    void write(ByteView bytes) override;
    const line::Counters& counters() override { return counters_; }
    void reset(const std::string& why) override { lose(50ms, why); }

    /// Bytes have arrived here.
    void come(ByteView bytes);
    /// The device is gone, and back later.
    void lose(Duration pause, const std::string& why);

    bool deaf = false;  ///< broken on purpose: reads only when the loop wakes

  private:
    void wake();
    void read();

    Agenda& agenda_;
    Wire& wire_;
    Random& random_;
    Duration wake_;
    Reach reach_;
    Events* events_ = nullptr;
    Bytes device_;
    bool waking_ = false;
    bool held_ = false;
    line::Counters counters_;
};

}  // namespace panelgate::scenario
