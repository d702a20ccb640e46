#pragma once

#include <string>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/line/port_ops.hpp"

namespace panelgate::line {

/// What came of setting up an open serial device.
struct SetUp {
    std::string error;    ///< not empty: the device cannot be used, and why
    std::string warning;  ///< not empty: it works, but something was not taken (a pty drops parity)
};

/// Raw mode by hand (every byte value passes, read() gives what is there), the format, any integer
/// rate through termios2/BOTHER, then reads back what the driver took. A rate that is more than 2 %
/// off is a warning.
SetUp set_up_tty(int descriptor, const SerialFormat& format, PortOps& ops = kernel_ops());

/// Is a device set to this rate, within the 2 % that a receiver tolerates, and to odd parity only
/// if the format has it? Asked at the master of a pseudo-terminal: what its users speak (a pty
/// forgets whether there is any parity). True when it cannot be told.
bool tty_speaks(int descriptor, const SerialFormat& format, PortOps& ops = kernel_ops());

}  // namespace panelgate::line
