#include "conversation.hpp"

#include <asm/ioctls.h>

#include <cstdio>
#include <cstring>
#include <iostream>

#include "driver.hpp"
#include "panelgate/line/termios_setup.hpp"

namespace panelgate::line {

void tell_host(const std::string& what) {
    std::printf("host: %s\n", what.c_str());
    std::fflush(stdout);
    std::string done;
    std::getline(std::cin, done);
}

int ask(int fd, unsigned long request, void* argument) {
    return kernel_ops().control(fd, request, argument);
}

termios2 settings_of(int fd) {
    termios2 t{};
    ask(fd, TCGETS2, &t);
    return t;
}

std::string set_up(Port& port, const SerialFormat& format) {
    if (!port.is_open()) return std::strerror(port.error());
    const SetUp result = set_up_tty(port.fd(), format);
    return result.error + result.warning;
}

Bytes all_values() {
    Bytes bytes;
    for (int value = 0; value < 256; ++value) bytes.push_back(static_cast<std::uint8_t>(value));
    return bytes;
}

std::string exchange(Port& port, const Bytes& bytes) {
    if (!port.write(bytes)) return "cannot be written";
    const Bytes got = port.read(bytes.size());
    for (std::size_t i = 0; i < got.size(); ++i) {
        if (got[i] == static_cast<std::uint8_t>(~bytes[i])) continue;
        return "byte " + std::to_string(i) + " was " + std::to_string(got[i]) + " for " +
               std::to_string(bytes[i]) + " inverted";
    }
    if (got.size() < bytes.size()) return "only " + std::to_string(got.size()) + " came back";
    return port.read(1, 50).empty() ? "" : "more came back than was sent";
}

std::string take_over(Port& port) {
    std::string wrong = set_up(port, kPlain);
    const Driver driver = look_at_driver(port.fd(), kernel_ops());
    wait_until([&] { return unsent_time(port.fd(), driver, 1ms, kernel_ops()) == 0ms; });
    tell_host("answer");
    return wrong.empty() ? exchange(port, all_values()) : wrong;
}

void use_as_terminal(int fd) {
    termios2 t = settings_of(fd);
    t.c_iflag = ICRNL | IXON | IXOFF | ISTRIP | PARMRK | INPCK | IUCLC;
    t.c_oflag = OPOST | ONLCR | OLCUC;
    t.c_lflag = ICANON | ECHO | ISIG | IEXTEN;
    t.c_cflag = CS7 | PARENB | PARODD | CSTOPB | CREAD | B300 | CRTSCTS;
    t.c_cc[VSTART] = 0x11;
    t.c_cc[VSTOP] = 0x13;
    t.c_cc[VMIN] = 0;
    t.c_cc[VTIME] = 7;
    ask(fd, TCSETS2, &t);
}

}  // namespace panelgate::line
