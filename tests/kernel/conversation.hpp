#pragma once

#include <asm/termbits.h>

#include <poll.h>

#include <string>

#include "panelgate/base/serial_format.hpp"
#include "port.hpp"

namespace panelgate::line {

constexpr SerialFormat kPlain{19'200, 8, Parity::none, 1};

/// Returns when the host says, on the console, that it has done so. "mute": no byte goes back any
/// more; "answer": again; "send HEX"; "break"; "unplug"; "plug".
void tell_host(const std::string& what);

/// As ioctl(), an error as the negative errno.
int ask(int fd, unsigned long request, void* argument);
termios2 settings_of(int fd);

/// set_up_tty(): its error or warning, or why the port is not open.
std::string set_up(Port& port, const SerialFormat& format);

Bytes all_values();
/// Empty when all of it came through both ways: the host inverts, so that two faults cannot make up
/// for each other.
std::string exchange(Port& port, const Bytes& bytes);

/// As terminal programs leave a port: cooked, echo, both kinds of flow control, 7 bits.
void use_as_terminal(int fd);
/// Sets up the port that somebody else used while the host was mute, and has it answer again. Empty
/// when all byte values pass then.
std::string take_over(Port& port);

/// Until `wanted` holds, for 10 s at most.
template <class Condition>
bool wait_until(Condition wanted) {
    for (int i = 0; i < 1000 && !wanted(); ++i) ::poll(nullptr, 0, 10);
    return wanted();
}

}  // namespace panelgate::line
