#pragma once

#include <optional>
#include <string>

#include "panelgate/base/time.hpp"
#include "panelgate/line/counters.hpp"
#include "panelgate/line/port_ops.hpp"

namespace panelgate::line {

/// What else the driver of an open device can do. None of it is needed; each is asked for once.
struct Driver {
    bool tells_queue = false;  ///< TIOCOUTQ counts what has not left
    bool tells_empty = false;  ///< TIOCSERGETLSR tells when the last bit has: a real UART
};
Driver look_at_driver(int fd, PortOps& ops);

/// How long the wire still needs for what was written, as far as the driver tells: never blocks.
Duration unsent_time(int fd, const Driver& driver, Duration character, PortOps& ops);

/// Throws away what was written and has not left. usbserial cannot, and goes on holding it.
void drop_unsent(int fd, PortOps& ops);

/// Received bytes are to be handed over at once and not when a timer of the adapter says so (FTDI:
/// 16 ms): ASYNC_LOW_LATENCY, else the adapter's `latency_timer` under `sysfs`. Empty when that is
/// done or there is nothing to do; else what slows the line down, and what helps.
std::string ask_low_latency(int fd, const std::string& device, PortOps& ops,
                            const std::string& sysfs = "/sys");

/// The driver's error counters since the first look, over all openings of the device.
class UartErrorCount {
  public:
    /// A device was opened: it counts from here on.
    void opened(int fd, PortOps& ops);
    /// Nothing when the driver does not count.
    std::optional<UartErrors> look(int fd, PortOps& ops);
    /// While the device is closed.
    std::optional<UartErrors> last() const { return sum_; }

  private:
    struct Raw {
        std::uint32_t framing = 0;
        std::uint32_t parity = 0;
        std::uint32_t overruns = 0;
        std::uint32_t breaks = 0;
    };
    static std::optional<Raw> read(int fd, PortOps& ops);

    std::optional<Raw> seen_;
    std::optional<UartErrors> sum_;
};

}  // namespace panelgate::line
