// How an open serial device is set up: format (termios2) and RS-485.
#include <asm/termbits.h>  // not with <termios.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <functional>
#include <string>

#include "panelgate/line/pty.hpp"
#include "panelgate/line/termios_setup.hpp"
#include "rs485.hpp"
#include "scripted_ops.hpp"

namespace panelgate::line::set_up_test {
namespace {

constexpr int kNoDevice = -1;

/// A serial driver that stores its settings, except for what a test changes.
class TermiosSetup : public testing::Test {
  protected:
    TermiosSetup() {
        // As a terminal program leaves it: cooked, with flow control.
        kept.c_iflag = IXON | IXOFF | ICRNL | ISTRIP | PARMRK;
        kept.c_oflag = OPOST | ONLCR;
        kept.c_lflag = ICANON | ECHO | ISIG;
        kept.c_cflag = CS7 | PARENB | PARODD | CMSPAR | CSTOPB | CRTSCTS | B9600 | HUPCL;
        ops.keep(TCSETS2, TCGETS2, kept);
        ops.answers[TCFLSH] = [this](void*) {
            flushed = true;
            return 0;
        };
    }
    line::SetUp set_up(const SerialFormat& format) { return set_up_tty(kNoDevice, format, ops); }
    /// From now on the driver changes what it is set to.
    void change(const std::function<void()>& by) {
        ops.answers[TCSETS2] = [this, by](void* argument) {
            std::memcpy(&kept, argument, sizeof kept);
            by();
            return 0;
        };
    }

    ScriptedOps ops;
    termios2 kept{};
    bool flushed = false;
};

TEST_F(TermiosSetup, LeavesNothingOfAnEarlierUser) {
    EXPECT_EQ(set_up({38400, 8, Parity::none, 1}).warning, "");
    EXPECT_EQ(kept.c_iflag, static_cast<tcflag_t>(IGNBRK));
    EXPECT_EQ(kept.c_oflag, 0u);
    EXPECT_EQ(kept.c_lflag, 0u);
    EXPECT_EQ(kept.c_cflag, static_cast<tcflag_t>(CS8 | CREAD | CLOCAL | HUPCL | BOTHER));
    EXPECT_EQ(kept.c_cc[VMIN], 1);
    EXPECT_EQ(kept.c_cc[VTIME], 0);
    EXPECT_EQ(kept.c_ospeed, 38400u);
    EXPECT_EQ(kept.c_ispeed, 38400u);
    EXPECT_TRUE(flushed);
}

TEST_F(TermiosSetup, EveryFormatIsWhatItSays) {
    struct Row {
        SerialFormat format;
        tcflag_t flags;
    };
    const Row rows[] = {
        {{9600, 8, Parity::even, 1}, CS8 | PARENB},
        {{9600, 8, Parity::odd, 1}, CS8 | PARENB | PARODD},
        {{9600, 8, Parity::none, 2}, CS8 | CSTOPB},
        {{9600, 7, Parity::even, 1, SerialMode::ascii}, CS7 | PARENB},
    };
    for (const auto& [format, flags] : rows) {
        set_up(format);
        EXPECT_EQ(kept.c_cflag & (CSIZE | PARENB | PARODD | CSTOPB), flags) << to_string(format);
        // Wrong parity becomes 00, which the CRC detects.
        EXPECT_EQ((kept.c_iflag & INPCK) != 0, format.parity != Parity::none);
    }
}

TEST_F(TermiosSetup, ARateThatIsMoreThanTwoPercentOffIsAWarning) {
    struct Row {
        int asked;
        speed_t made;
        const char* warning;
    };
    const Row rows[] = {
        {12'345, 12'376, ""},
        {100'000, 98'000, ""},  // 2.0 %
        {100'000, 97'900, "the driver made 97900 bit/s of 100000"},
        // A 16550 of 1.8432 MHz, asked for what it cannot do, keeps what it had.
        {250'000, 115'200, "the driver made 115200 bit/s of 250000"},
    };
    for (const auto& [asked, made, warning] : rows) {
        change([&, rate = made] { kept.c_ospeed = kept.c_ispeed = rate; });
        const line::SetUp result = set_up({asked, 8, Parity::none, 1});
        EXPECT_EQ(result.error, "");
        EXPECT_EQ(result.warning, warning);
    }
}

TEST_F(TermiosSetup, WhatADriverDropsIsAWarning) {
    // cdc_acm firmware, ptys
    change([&] { kept.c_cflag &= ~static_cast<tcflag_t>(PARENB | CSTOPB); });
    EXPECT_EQ(set_up({9600, 8, Parity::even, 2}).warning,
              "parity was not taken; stop bits were not taken");
}

TEST_F(TermiosSetup, ARefusalIsAnErrorWithItsReason) {
    ops.refuse(TCSETS2, EINVAL);
    EXPECT_EQ(set_up({}).error, "the driver refuses these settings: Invalid argument");
    ops.refuse(TCGETS2, EIO);  // ttyS3 without a UART
    EXPECT_EQ(set_up({}).error, "there is no UART behind it: Input/output error");
    ops.refuse(TCGETS2, ENOTTY);
    EXPECT_EQ(set_up({}).error, "not a serial device: Inappropriate ioctl for device");
}

TEST(TtySpeaks, IsUnderstoodAtItsOwnRateAndDetectsOddParityButNotNoneFromEven) {
    struct Row {
        SerialFormat set;  ///< at the other end
        SerialFormat heard;
        bool understood;
    };
    constexpr SerialFormat kNone{38400, 8, Parity::none, 1};
    constexpr SerialFormat kEven{9600, 8, Parity::even, 1};
    constexpr SerialFormat kOdd{9600, 8, Parity::odd, 1};
    const Row rows[] = {
        {kNone, kNone, true},
        {kNone, {38000, 8, Parity::none, 1}, true},  // within 2 %
        {kNone, {19200, 8, Parity::none, 1}, false},
        {kNone, {57600, 8, Parity::none, 1}, false},
        {kOdd, kOdd, true},
        {kOdd, kEven, false},
        {kEven, {9600, 8, Parity::none, 1}, true},
        {kEven, kOdd, false},
    };
    for (const auto& [set, heard, understood] : rows) {
        const Pty pty;
        set_up_tty(pty.master(), set);
        EXPECT_EQ(tty_speaks(pty.master(), heard), understood)
            << to_string(set) << ", " << to_string(heard);
    }
}

class Rs485SetUp : public testing::Test {
  protected:
    Rs485SetUp() {
        settings.mode = Rs485::Mode::kernel;
        settings.delay_before_send = 1ms;
        settings.delay_after_send = 2ms;
    }
    line::SetUp set_up() { return set_up_rs485(kNoDevice, settings, ops); }

    ScriptedOps ops;
    Rs485 settings;
};

TEST_F(Rs485SetUp, HandsTheDriverPolarityDelaysAndReceiving) {
    struct Row {
        bool rts_high_on_send;
        bool receive_during_send;
        unsigned flags;
    };
    const Row rows[] = {
        {true, true, SER_RS485_ENABLED | SER_RS485_RTS_ON_SEND | SER_RS485_RX_DURING_TX},
        {false, false, SER_RS485_ENABLED | SER_RS485_RTS_AFTER_SEND},  // low: high else
    };
    serial_rs485 kept{};
    ops.keep(TIOCSRS485, TIOCGRS485, kept);
    for (const Row& row : rows) {
        settings.rts_high_on_send = row.rts_high_on_send;
        settings.receive_during_send = row.receive_during_send;
        const line::SetUp result = set_up();
        EXPECT_EQ(result.error, "");
        EXPECT_EQ(result.warning, "");
        EXPECT_EQ(kept.flags, row.flags);
        EXPECT_EQ(kept.delay_rts_before_send, 1u);
        EXPECT_EQ(kept.delay_rts_after_send, 2u);
    }
}

TEST_F(Rs485SetUp, ADriverThatDoesNotSwitchIsAnErrorThatNamesAlternatives) {
    const std::string instead =
        "; use rs485 mode off with an adapter that switches by itself, or mode rts";
    // ENOTTY, as 8250 without RS-485, every USB adapter and a pty answer
    EXPECT_EQ(set_up().error, "its driver cannot switch RS-485 (TIOCSRS485)" + instead);
    ops.refuse(TIOCSRS485, EINVAL);
    EXPECT_EQ(set_up().error, "its driver refuses this RS-485 mode: Invalid argument" + instead);
    ops.give(TIOCSRS485, serial_rs485{});
    ops.give(TIOCGRS485, serial_rs485{});
    EXPECT_EQ(set_up().error, "its driver took RS-485 mode and left it off" + instead);
}

TEST_F(Rs485SetUp, WhatTheDriverMadeDifferentIsAWarning) {
    serial_rs485 made{};  // i.MX without an RTS pin of its own: polarity and delays are its own
    made.flags = SER_RS485_ENABLED | SER_RS485_RTS_AFTER_SEND | SER_RS485_RX_DURING_TX;
    ops.give(TIOCSRS485, made);
    EXPECT_EQ(set_up().warning, "the RS-485 mode cannot be read back");
    ops.give(TIOCGRS485, made);
    const line::SetUp result = set_up();
    EXPECT_EQ(result.error, "");
    EXPECT_EQ(result.warning,
              "rts_on_send was not taken; receive_during_send was not taken; the driver made "
              "delay_before_send 0 ms of 1 ms; the driver made delay_after_send 0 ms of 2 ms");
}

TEST_F(Rs485SetUp, RtsFollowsItsPolarity) {
    int level = -1;
    const auto switched = [&level](int made) {
        return [&level, made](void* lines) {
            EXPECT_EQ(*static_cast<int*>(lines), TIOCM_RTS);
            level = made;
            return 0;
        };
    };
    ops.answers[TIOCMBIS] = switched(1);
    ops.answers[TIOCMBIC] = switched(0);
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
}  // namespace panelgate::line::set_up_test
