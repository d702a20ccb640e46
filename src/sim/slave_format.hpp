#pragma once

#include "panelgate/base/serial_format.hpp"

namespace panelgate::sim {

/// Do programs at the other end of this pseudo-terminal's master speak at this rate, as far as a
/// pty shows it: within 2 % (serial line V1.02, 3.2), and odd parity only where the line has it.
/// A pty forgets whether there is any parity. True when it cannot be told.
bool slave_speaks(int master, const SerialFormat& format);

}  // namespace panelgate::sim
