#include "slave_format.hpp"

#include <gtest/gtest.h>

#include "panelgate/line/pty.hpp"
#include "panelgate/line/termios_setup.hpp"

namespace panelgate::sim {
namespace {

TEST(SlaveFormat, IsUnderstoodAtItsOwnRateOnly) {
    const SerialFormat format{38400, 8, Parity::none, 1};
    const line::Pty pty;
    line::set_up_tty(pty.master(), format);  // of the other end
    EXPECT_TRUE(slave_speaks(pty.master(), format));
    EXPECT_TRUE(slave_speaks(pty.master(), {38000, 8, Parity::none, 1})) << "within 2 %";
    EXPECT_FALSE(slave_speaks(pty.master(), {19200, 8, Parity::none, 1}));
    EXPECT_FALSE(slave_speaks(pty.master(), {57600, 8, Parity::none, 1}));
}

TEST(SlaveFormat, TellsOddParityButNoneFromEvenAPtyForgets) {
    const line::Pty pty;
    line::set_up_tty(pty.master(), {9600, 8, Parity::odd, 1});
    EXPECT_TRUE(slave_speaks(pty.master(), {9600, 8, Parity::odd, 1}));
    EXPECT_FALSE(slave_speaks(pty.master(), {9600, 8, Parity::even, 1}));
    line::set_up_tty(pty.master(), {9600, 8, Parity::even, 1});
    EXPECT_TRUE(slave_speaks(pty.master(), {9600, 8, Parity::none, 1}));
    EXPECT_FALSE(slave_speaks(pty.master(), {9600, 8, Parity::odd, 1}));
}

}  // namespace
}  // namespace panelgate::sim
