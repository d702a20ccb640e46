#pragma once

#include "panelgate/line/port_ops.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/line/termios_setup.hpp"

namespace panelgate::line {

/// Mode kernel: has the driver switch the transceiver, and reads back what it took. A driver that
/// cannot is an error, for a panel would never hear anything.
SetUp set_up_rs485(int fd, const Rs485& settings, PortOps& ops);

/// Mode rts: RTS to what `sending` asks for. Empty, or why not.
std::string switch_rts(int fd, const Rs485& settings, bool sending, PortOps& ops);

}  // namespace panelgate::line
