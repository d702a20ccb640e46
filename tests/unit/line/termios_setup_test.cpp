#include "panelgate/line/termios_setup.hpp"

#include <asm/termbits.h>  // not with <termios.h>
#include <gtest/gtest.h>

#include "scripted_ops.hpp"

namespace panelgate::line::termios_setup_test {
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
    auto set_up(const SerialFormat& format) { return set_up_tty(kNoDevice, format, ops); }
    /// From now on the driver sets this instead of every rate.
    void make_rate(speed_t rate) {
        ops.answers[TCSETS2] = [this, rate](void* argument) {
            std::memcpy(&kept, argument, sizeof kept);
            kept.c_ospeed = kept.c_ispeed = rate;
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
    const tcflag_t mask = CSIZE | PARENB | PARODD | CSTOPB;
    set_up({9600, 8, Parity::even, 1});
    EXPECT_EQ(kept.c_cflag & mask, static_cast<tcflag_t>(CS8 | PARENB));
    EXPECT_NE(kept.c_iflag & INPCK, 0u);  // wrong parity becomes 00, which the CRC detects
    set_up({9600, 8, Parity::odd, 1});
    EXPECT_EQ(kept.c_cflag & mask, static_cast<tcflag_t>(CS8 | PARENB | PARODD));
    set_up({9600, 8, Parity::none, 2});
    EXPECT_EQ(kept.c_cflag & mask, static_cast<tcflag_t>(CS8 | CSTOPB));
    EXPECT_EQ(kept.c_iflag & INPCK, 0u);
    set_up({9600, 7, Parity::even, 1, SerialMode::ascii});
    EXPECT_EQ(kept.c_cflag & mask, static_cast<tcflag_t>(CS7 | PARENB));
}

TEST_F(TermiosSetup, ARateThatIsNearlyMetIsFine) {
    make_rate(12'376);
    EXPECT_EQ(set_up({12'345, 8, Parity::none, 1}).warning, "");
    make_rate(98'000);
    EXPECT_EQ(set_up({100'000, 8, Parity::none, 1}).warning, "");  // 2.0 %
}

TEST_F(TermiosSetup, ARateThatIsMoreThanTwoPercentOffIsAWarning) {
    make_rate(115'200);  // a 16550 of 1.8432 MHz, asked for what it cannot do, keeps what it had
    const auto result = set_up({250'000, 8, Parity::none, 1});
    EXPECT_EQ(result.error, "");
    EXPECT_EQ(result.warning, "the driver made 115200 bit/s of 250000");
    make_rate(97'900);
    EXPECT_EQ(set_up({100'000, 8, Parity::none, 1}).warning,
              "the driver made 97900 bit/s of 100000");
}

TEST_F(TermiosSetup, WhatADriverDropsIsAWarning) {
    ops.answers[TCSETS2] = [this](void* argument) {
        std::memcpy(&kept, argument, sizeof kept);
        kept.c_cflag &= ~static_cast<tcflag_t>(PARENB | CSTOPB);  // cdc_acm firmware, ptys
        return 0;
    };
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

}  // namespace
}  // namespace panelgate::line::termios_setup_test
