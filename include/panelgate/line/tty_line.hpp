#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>

#include "panelgate/line/line.hpp"
#include "panelgate/line/port_ops.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::line {

/// A serial device (or pty) through termios on a non-blocking descriptor. Read 0, EIO, ENODEV,
/// ENXIO and a hang-up all mean the device has gone: it is closed at once and opened again with
/// back-off, every setting applied anew. undelivered(): it did not take what was written, or its
/// driver still holds it long after its time; bytes that an adapter has taken and keeps to itself
/// are not seen. `clock` and `ops` outlive the line.
std::unique_ptr<Line> make_tty_line(boost::asio::any_io_executor executor, rt::Clock& clock,
                                    Settings settings, PortOps& ops = kernel_ops());

}  // namespace panelgate::line
