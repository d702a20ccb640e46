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

}  // namespace panelgate::line
