#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::line {

struct Settings {
    std::string device;  ///< path of a serial device, or tcp://HOST:PORT
    SerialFormat serial;
    Duration reopen_min = 100ms;  ///< back-off between attempts to open, doubled each time
    Duration reopen_max = 1s;
};

/// "tcp://HOST:PORT", "tcp://[::1]:4001": nothing on anything else.
struct TcpEndpoint {
    std::string host;
    std::string port;
};
std::optional<TcpEndpoint> parse_tcp_device(std::string_view device);

}  // namespace panelgate::line
