#include "rs485.hpp"

#include <asm/ioctls.h>
#include <asm/termios.h>  // TIOCM_RTS; not with <termios.h>
#include <linux/serial.h>

#include <cerrno>
#include <cstring>
#include <string>

namespace panelgate::line {
namespace {

std::uint32_t milliseconds(Duration duration) { return static_cast<std::uint32_t>(duration / 1ms); }

serial_rs485 wanted_by(const Rs485& settings) {
    serial_rs485 rs485{};
    rs485.flags = SER_RS485_ENABLED;
    // The level of RTS while sending, and else: exactly one of the two.
    rs485.flags |= settings.rts_high_on_send ? SER_RS485_RTS_ON_SEND : SER_RS485_RTS_AFTER_SEND;
    if (settings.receive_during_send) rs485.flags |= SER_RS485_RX_DURING_TX;
    rs485.delay_rts_before_send = milliseconds(settings.delay_before_send);
    rs485.delay_rts_after_send = milliseconds(settings.delay_after_send);
    return rs485;
}

std::string difference(const serial_rs485& wanted, const serial_rs485& got) {
    std::string text;
    const auto differs = [&](std::uint32_t mask) {
        return ((wanted.flags ^ got.flags) & mask) != 0;
    };
    const auto delay = [&](const char* name, std::uint32_t w, std::uint32_t g) {
        if (w == g) return;
        text += std::string("the driver made ") + name + ' ' + std::to_string(g) + " ms of " +
                std::to_string(w) + " ms; ";
    };
    if (differs(SER_RS485_RTS_ON_SEND | SER_RS485_RTS_AFTER_SEND))
        text += "rts_on_send was not taken; ";
    if (differs(SER_RS485_RX_DURING_TX)) text += "receive_during_send was not taken; ";
    delay("delay_before_send", wanted.delay_rts_before_send, got.delay_rts_before_send);
    delay("delay_after_send", wanted.delay_rts_after_send, got.delay_rts_after_send);
    if (!text.empty()) text.resize(text.size() - 2);
    return text;
}

}  // namespace

SetUp set_up_rs485(int fd, const Rs485& settings, PortOps& ops) {
    constexpr const char* kInstead =
        "; use rs485 mode off with an adapter that switches by itself, or mode rts";
    const serial_rs485 wanted = wanted_by(settings);
    serial_rs485 given = wanted;
    const int result = ops.control(fd, TIOCSRS485, &given);
    if (result == -ENOTTY) {
        return {std::string("its driver cannot switch RS-485 (TIOCSRS485)") + kInstead, {}};
    }
    if (result < 0) {
        return {"its driver refuses this RS-485 mode: " + std::string(std::strerror(-result)) +
                    kInstead,
                {}};
    }
    serial_rs485 got{};
    if (ops.control(fd, TIOCGRS485, &got) < 0) {
        return {{}, "the RS-485 mode cannot be read back"};
    }
    if ((got.flags & SER_RS485_ENABLED) == 0) {
        return {std::string("its driver took RS-485 mode and left it off") + kInstead, {}};
    }
    return {{}, difference(wanted, got)};
}

std::string switch_rts(int fd, const Rs485& settings, bool sending, PortOps& ops) {
    int lines = TIOCM_RTS;
    const bool high = sending == settings.rts_high_on_send;
    const int result = ops.control(fd, high ? TIOCMBIS : TIOCMBIC, &lines);
    if (result >= 0) return {};
    return "it has no RTS that a program can switch: " + std::string(std::strerror(-result)) +
           "; use rs485 mode off with an adapter that switches by itself";
}

}  // namespace panelgate::line
