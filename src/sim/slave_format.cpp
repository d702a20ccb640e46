#include "slave_format.hpp"

// <asm/termbits.h> has termios2 and clashes with <termios.h>.
#include <asm/termbits.h>
#include <sys/ioctl.h>

#include <cstdlib>

namespace panelgate::sim {

bool slave_speaks(int master, const SerialFormat& format) {
    termios2 slave{};
    if (::ioctl(master, TCGETS2, &slave) != 0) return true;  // asked at the master: the slave's
    constexpr long long kTolerance = 50;                     // a fiftieth
    const long long off = std::llabs(static_cast<long long>(slave.c_ospeed) - format.baud);
    const bool odd = (slave.c_cflag & PARODD) != 0;
    return off * kTolerance <= format.baud && odd == (format.parity == Parity::odd);
}

}  // namespace panelgate::sim
