#pragma once

#include "panelgate/line/port_ops.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/line/termios_setup.hpp"

namespace panelgate::line {

/// Mode kernel: makes the driver switch the transceiver, and reads back what it took. A driver that
/// cannot is an error, as no panel would hear anything.
SetUp set_up_rs485(int fd, const Rs485& settings, PortOps& ops);

/// Mode rts: switches RTS for sending or receiving. Returns an empty text, or the error.
std::string switch_rts(int fd, const Rs485& settings, bool sending, PortOps& ops);

}  // namespace panelgate::line
