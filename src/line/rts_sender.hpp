#pragma once

#include <functional>
#include <memory>
#include <string>

#include "driver.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/line/port_ops.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::line {

/// RS-485 mode rts: raises RTS, sends, and lowers RTS when the last bit should have left. Best
/// effort: timers and USB make it late by some milliseconds, never early as far as the driver
/// reports. Single-threaded; one frame at a time (a second one during the first extends it).
class RtsSender {
  public:
    struct Owner {
        std::function<void(ByteView)> send;              ///< to the device, now
        std::function<void(const std::string&)> failed;  ///< the device must be closed
    };
    /// `clock`, `settings` and `ops` outlive it.
    RtsSender(rt::Clock& clock, const Settings& settings, Owner owner, PortOps& ops);

    /// After opening: sets RTS to receiving. Returns an empty text, or the error.
    std::string opened(int fd, const Driver& driver);
    void write(ByteView bytes);
    /// Before closing: drops pending bytes.
    void closing();

  private:
    void at(TimePoint when, void (RtsSender::*next)());
    void send_pending();
    void release();
    bool switch_to(bool sending);

    rt::Clock& clock_;
    std::unique_ptr<rt::Alarm> alarm_;
    const Settings& settings_;
    Owner owner_;
    PortOps& ops_;
    int fd_ = -1;
    Driver driver_;
    Bytes held_;  ///< until delay_before_send is over
    TimePoint end_{};
    std::shared_ptr<bool> alive_;
};

}  // namespace panelgate::line
