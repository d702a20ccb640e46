#include "rs485.hpp"

#include <gtest/gtest.h>

#include "scripted_ops.hpp"

namespace panelgate::line::rs485_test {
namespace {

constexpr int kNoDevice = -1;

Rs485 kernel_mode() {
    Rs485 settings;
    settings.mode = Rs485::Mode::kernel;
    settings.delay_before_send = 1ms;
    settings.delay_after_send = 2ms;
    return settings;
}

TEST(Rs485, HandsTheDriverPolarityDelaysAndReceiving) {
    ScriptedOps ops;
    serial_rs485 kept{};
    ops.keep(TIOCSRS485, TIOCGRS485, kept);
    Rs485 settings = kernel_mode();
    settings.receive_during_send = true;
    const auto result = set_up_rs485(kNoDevice, settings, ops);
    EXPECT_EQ(result.error, "");
    EXPECT_EQ(result.warning, "");
    EXPECT_EQ(kept.flags, static_cast<std::uint32_t>(SER_RS485_ENABLED | SER_RS485_RTS_ON_SEND |
                                                     SER_RS485_RX_DURING_TX));
    EXPECT_EQ(kept.delay_rts_before_send, 1u);
    EXPECT_EQ(kept.delay_rts_after_send, 2u);
}

TEST(Rs485, ALowLevelWhileSendingIsAHighOneElse) {
    ScriptedOps ops;
    serial_rs485 kept{};
    ops.keep(TIOCSRS485, TIOCGRS485, kept);
    Rs485 settings = kernel_mode();
    settings.rts_high_on_send = false;
    set_up_rs485(kNoDevice, settings, ops);
    EXPECT_EQ(kept.flags, static_cast<std::uint32_t>(SER_RS485_ENABLED | SER_RS485_RTS_AFTER_SEND));
}

TEST(Rs485, ADriverWithoutItIsAnErrorThatNamesAlternatives) {
    ScriptedOps ops;  // ENOTTY, as 8250 without RS-485, every USB adapter and a pty answer
    EXPECT_EQ(set_up_rs485(kNoDevice, kernel_mode(), ops).error,
              "its driver cannot switch RS-485 (TIOCSRS485); use rs485 mode off with an adapter "
              "that switches by itself, or mode rts");
}

TEST(Rs485, ADriverThatRefusesTheSettingsIsAnError) {
    ScriptedOps ops;
    ops.refuse(TIOCSRS485, EINVAL);
    EXPECT_EQ(set_up_rs485(kNoDevice, kernel_mode(), ops).error,
              "its driver refuses this RS-485 mode: Invalid argument; use rs485 mode off with an "
              "adapter that switches by itself, or mode rts");
}

TEST(Rs485, ADriverThatTakesItAndStaysOffIsAnError) {
    ScriptedOps ops;
    ops.give(TIOCSRS485, serial_rs485{});
    ops.give(TIOCGRS485, serial_rs485{});
    EXPECT_NE(set_up_rs485(kNoDevice, kernel_mode(), ops).error.find("left it off"),
              std::string::npos);
}

TEST(Rs485, WhatTheDriverMadeDifferentIsAWarning) {
    ScriptedOps ops;
    serial_rs485 made{};  // i.MX without an RTS pin of its own: polarity and delays are its own
    made.flags = SER_RS485_ENABLED | SER_RS485_RTS_AFTER_SEND | SER_RS485_RX_DURING_TX;
    ops.give(TIOCSRS485, made);
    ops.give(TIOCGRS485, made);
    const auto result = set_up_rs485(kNoDevice, kernel_mode(), ops);
    EXPECT_EQ(result.error, "");
    EXPECT_EQ(result.warning,
              "rts_on_send was not taken; receive_during_send was not taken; the driver made "
              "delay_before_send 0 ms of 1 ms; the driver made delay_after_send 0 ms of 2 ms");
}

TEST(Rs485, ADriverThatCannotBeReadBackIsAWarning) {
    ScriptedOps ops;
    ops.give(TIOCSRS485, serial_rs485{});
    EXPECT_EQ(set_up_rs485(kNoDevice, kernel_mode(), ops).warning,
              "the RS-485 mode cannot be read back");
}

TEST(Rs485, RtsFollowsItsPolarity) {
    ScriptedOps ops;
    int level = -1;
    ops.answers[TIOCMBIS] = [&](void* lines) {
        EXPECT_EQ(*static_cast<int*>(lines), TIOCM_RTS);
        level = 1;
        return 0;
    };
    ops.answers[TIOCMBIC] = [&](void* lines) {
        EXPECT_EQ(*static_cast<int*>(lines), TIOCM_RTS);
        level = 0;
        return 0;
    };
    Rs485 settings;
    settings.mode = Rs485::Mode::rts;
    for (const bool high : {true, false}) {
        settings.rts_high_on_send = high;
        for (const bool sending : {true, false}) {
            EXPECT_EQ(switch_rts(kNoDevice, settings, sending, ops), "");
            EXPECT_EQ(level == 1, sending == high);
        }
    }
    ScriptedOps none;
    EXPECT_EQ(switch_rts(kNoDevice, settings, true, none),
              "it has no RTS that a program can switch: Inappropriate ioctl for device; use rs485 "
              "mode off with an adapter that switches by itself");
}

}  // namespace
}  // namespace panelgate::line::rs485_test
