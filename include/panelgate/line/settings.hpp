#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::line {

/// Who switches an RS-485 transceiver to sending, and how.
struct Rs485 {
    enum class Mode : std::uint8_t {
        off,     ///< the adapter does it by itself
        kernel,  ///< the driver does it (TIOCSRS485), to the bit
        rts,     ///< this program does it with RTS, as well as timers allow
    };
    Mode mode = Mode::off;
    bool rts_high_on_send = true;
    /// From RTS to the first bit, and from the last bit back: 0 to 100 ms, whole ones for the
    /// kernel.
    Duration delay_before_send{};
    Duration delay_after_send{};
    bool receive_during_send = false;  ///< kernel only: the line hears itself
    friend bool operator==(const Rs485&, const Rs485&) = default;
};

struct Settings {
    std::string device;  ///< path of a serial device, or tcp://HOST:PORT
    SerialFormat serial;
    Rs485 rs485;                  ///< of a serial device
    Duration reopen_min = 100ms;  ///< back-off between attempts to open, doubled each time
    Duration reopen_max = 1s;
    /// The line's master is somebody else: the device is opened for reading only, and write() does
    /// nothing. A connection is only read.
    bool listen_only = false;
    /// Bytes a second that are read at most, but for bursts of a second; or four times what the
    /// line's rate can bring, where that is more. A device that never stops must not keep the loop
    /// from the other lines.
    std::size_t input_rate = 2 * 1024 * 1024;
    bool simulated = false;  ///< a pty of our own, which takes no parity: no word about that
    friend bool operator==(const Settings&, const Settings&) = default;
};

/// Digits and dots that are no IPv4 address, such as 10.0.0.300: no name looks like this.
bool is_broken_address(std::string_view host);

/// "tcp://HOST:PORT", "tcp://[::1]:4001": nothing on anything else. The host is a name of letters,
/// digits, '-', '_' and '.', or an address.
struct TcpEndpoint {
    std::string host;
    std::string port;
};
std::optional<TcpEndpoint> parse_tcp_device(std::string_view device);

}  // namespace panelgate::line
