#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/tls/settings.hpp"

namespace panelgate::line {

/// How an RS-485 transceiver is switched to sending.
struct Rs485 {
    enum class Mode : std::uint8_t {
        off,     ///< automatically by the adapter
        kernel,  ///< by the driver (TIOCSRS485), to the bit
        rts,     ///< by this program with RTS, as exactly as timers allow
    };
    Mode mode = Mode::off;
    bool rts_high_on_send = true;
    /// From RTS to the first bit, and from the last bit back: 0 to 100 ms, whole milliseconds for
    /// the kernel.
    Duration delay_before_send{};
    Duration delay_after_send{};
    bool receive_during_send = false;  ///< kernel only: sent bytes are echoed
    friend bool operator==(const Rs485&, const Rs485&) = default;
};

struct Settings {
    std::string device;  ///< path of a serial device, tcp://HOST:PORT or modbus-tcp://HOST:PORT
    SerialFormat serial;
    Rs485 rs485;                  ///< for a serial device
    Duration reopen_min = 100ms;  ///< back-off between attempts to open, doubled each time
    Duration reopen_max = 1s;
    /// Another device is the line's master: the device is opened read-only, and write() does
    /// nothing. A connection is only read.
    bool listen_only = false;
    /// Maximum input in bytes per second, apart from bursts of a second; or four times the line's
    /// rate, if that is more. A device that never stops must not block the other lines.
    std::size_t input_rate = 2 * 1024 * 1024;
    bool simulated = false;   ///< our own pty, which has no parity: no warning about that
    std::string owner{};      ///< "line 'floor1'": whose device it is, for messages
    bool modbus_tcp = false;  ///< the device speaks Modbus/TCP: its stations are unit ids
    /// The line's user writes and hears RTU frames all the same, one request at a time.
    bool as_rtu = false;
    std::optional<tls::Settings> tls{};  ///< of the connection to such a device
    friend bool operator==(const Settings&, const Settings&) = default;
};

/// True for a numeric host that is no IPv4 address, such as 10.0.0.300: no name looks like this.
bool is_broken_address(std::string_view host);

/// A serial device server: "tcp://HOST:PORT", "tcp://[::1]:4001"; or a device that speaks
/// Modbus/TCP: "modbus-tcp://HOST:PORT". std::nullopt for anything else.
/// The host is a name of letters, digits, '-', '_' and '.', or an address.
struct TcpEndpoint {
    std::string host;
    std::string port;
};
std::optional<TcpEndpoint> parse_tcp_device(std::string_view device);

}  // namespace panelgate::line
