#pragma once

#include <optional>
#include <string>

#include "panelgate/base/time.hpp"
#include "panelgate/line/counters.hpp"
#include "panelgate/line/port_ops.hpp"

namespace panelgate::line {

/// Optional features of an open device's driver; each is queried once.
struct Driver {
    bool tells_queue = false;  ///< TIOCOUTQ counts unsent bytes
    bool tells_empty = false;  ///< TIOCSERGETLSR reports when the last bit has left: a real UART
};
Driver look_at_driver(int fd, PortOps& ops);

/// Time until all written bytes have left, as far as the driver reports it. Never blocks.
Duration unsent_time(int fd, const Driver& driver, Duration character, PortOps& ops);

/// Discards unsent bytes. usbserial cannot, and keeps them.
void drop_unsent(int fd, PortOps& ops);

/// Asks for received bytes at once and not after an adapter's timer (FTDI: 16 ms): sets
/// ASYNC_LOW_LATENCY, and the adapter's `latency_timer` under `sysfs` if it is still higher than 1
/// ms. Returns an empty text if done or not needed; else what slows the line down, and what helps.
std::string ask_low_latency(int fd, const std::string& device, PortOps& ops,
                            const std::string& sysfs = "/sys");

/// Sums the driver's error counters over all openings of the device.
class UartErrorCount {
  public:
    /// A device was opened: starts from its current counters.
    void opened(int fd, PortOps& ops);
    /// Returns the sum; std::nullopt if the driver does not count.
    std::optional<UartErrors> look(int fd, PortOps& ops);
    /// Returns the last sum, while the device is closed.
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
