#include "panelgate/line/termios_setup.hpp"

// <asm/termbits.h> has termios2 and clashes with <termios.h>: this file is the only one to use it.
#include <asm/ioctls.h>
#include <asm/termbits.h>

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>

namespace panelgate::line {
namespace {

termios2 raw(const termios2& before, const SerialFormat& format) {
    termios2 t = before;
    t.c_iflag = IGNBRK;  // ignore breaks; parity errors pass, CRC or LRC detects them
    t.c_oflag = 0;
    t.c_lflag = 0;
    t.c_cflag &=
        ~static_cast<tcflag_t>(CSIZE | PARENB | PARODD | CMSPAR | CSTOPB | CRTSCTS | CBAUD);
    t.c_cflag |= CREAD | CLOCAL | BOTHER;
    t.c_cflag |= format.data_bits == 7 ? CS7 : CS8;
    if (format.parity != Parity::none) {
        t.c_cflag |= PARENB;
        t.c_iflag |= INPCK;
    }
    if (format.parity == Parity::odd) t.c_cflag |= PARODD;
    if (format.stop_bits == 2) t.c_cflag |= CSTOPB;
    t.c_ispeed = static_cast<speed_t>(format.baud);
    t.c_ospeed = static_cast<speed_t>(format.baud);
    t.c_cc[VMIN] = 1;  // read() of 0 bytes then means a hang-up
    t.c_cc[VTIME] = 0;
    return t;
}

/// True if within what a receiver tolerates (serial line V1.02, 3.2).
bool is_near(speed_t rate, int baud) {
    constexpr long long kTolerance = 50;  // a fiftieth: 2 %
    return std::llabs(static_cast<long long>(rate) - baud) * kTolerance <= baud;
}

std::string difference(const termios2& wanted, const termios2& got, const SerialFormat& format) {
    std::string text;
    const auto differs = [&](tcflag_t mask) {
        return ((wanted.c_cflag ^ got.c_cflag) & mask) != 0;
    };
    if (differs(CSIZE)) text += "data bits were not taken; ";
    if (differs(PARENB | PARODD)) text += "parity was not taken; ";
    if (differs(CSTOPB)) text += "stop bits were not taken; ";
    if (!is_near(got.c_ospeed, format.baud)) {
        text += "the driver made " + std::to_string(got.c_ospeed) + " bit/s of " +
                std::to_string(format.baud) + "; ";
    }
    if (!text.empty()) text.resize(text.size() - 2);
    return text;
}

}  // namespace

SetUp set_up_tty(int descriptor, const SerialFormat& format, PortOps& ops) {
    const auto failed = [](const char* what, int error) {
        return SetUp{std::string(what) + ": " + std::strerror(-error), {}};
    };
    termios2 before{};
    const int asked = ops.control(descriptor, TCGETS2, &before);
    // The answer of a ttyS without hardware, or an adapter unplugged a moment ago.
    if (asked == -EIO) return failed("there is no UART behind it", asked);
    if (asked < 0) return failed("not a serial device", asked);
    termios2 wanted = raw(before, format);
    if (const int result = ops.control(descriptor, TCSETS2, &wanted); result < 0)
        return failed("the driver refuses these settings", result);
    termios2 got{};
    if (const int result = ops.control(descriptor, TCGETS2, &got); result < 0)
        return failed("cannot read the settings back", result);
    // Discards what an earlier user left behind.
    ops.control(descriptor, TCFLSH, reinterpret_cast<void*>(std::uintptr_t{TCIOFLUSH}));
    return SetUp{{}, difference(wanted, got, format)};
}

bool tty_speaks(int descriptor, const SerialFormat& format, PortOps& ops) {
    termios2 set{};
    if (ops.control(descriptor, TCGETS2, &set) < 0) return true;
    const bool odd = (set.c_cflag & PARODD) != 0;
    return is_near(set.c_ospeed, format.baud) && odd == (format.parity == Parity::odd);
}

}  // namespace panelgate::line
