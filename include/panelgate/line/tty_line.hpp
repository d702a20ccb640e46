#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>

#include "panelgate/line/line.hpp"
#include "panelgate/line/port_ops.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::line {

/// Creates a line on a serial device (or pty): termios on a non-blocking descriptor. Read 0, EIO,
/// ENODEV, ENXIO and a hang-up all mean that the device is gone: it is closed at once and reopened
/// with back-off, with all settings applied again. undelivered(): the device did not take written
/// bytes, or its driver still has them long after their time; bytes kept inside an adapter are not
/// seen. `clock` and `ops` outlive the line.
std::unique_ptr<Line> make_tty_line(boost::asio::any_io_executor executor, rt::Clock& clock,
                                    Settings settings, PortOps& ops = kernel_ops());

}  // namespace panelgate::line
