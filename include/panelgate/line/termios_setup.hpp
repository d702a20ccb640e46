#pragma once

#include <string>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/line/port_ops.hpp"

namespace panelgate::line {

/// Result of setting up an open serial device.
struct SetUp {
    std::string error;    ///< not empty: the device cannot be used, and why
    std::string warning;  ///< not empty: it works, but a setting was not taken (a pty drops parity)
};

/// Sets raw mode (every byte value passes, read() returns what is there) and the format, any
/// integer rate through termios2/BOTHER, then reads back what the driver took. A rate that is off
/// by more than 2 % is a warning.
SetUp set_up_tty(int descriptor, const SerialFormat& format, PortOps& ops = kernel_ops());

/// True if a device is set to this rate, within the 2 % that a receiver tolerates, and to odd
/// parity exactly if the format has it. At the master of a pseudo-terminal: what its user has set
/// (a pty forgets other parity). True if it cannot be determined.
bool tty_speaks(int descriptor, const SerialFormat& format, PortOps& ops = kernel_ops());

}  // namespace panelgate::line
