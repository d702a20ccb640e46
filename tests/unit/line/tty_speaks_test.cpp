#include <gtest/gtest.h>

#include "panelgate/line/pty.hpp"
#include "panelgate/line/termios_setup.hpp"

namespace panelgate::line::tty_speaks_test {
namespace {

TEST(TtySpeaks, IsUnderstoodAtItsOwnRateOnly) {
    const SerialFormat format{38400, 8, Parity::none, 1};
    const Pty pty;
    set_up_tty(pty.master(), format);  // of the other end
    EXPECT_TRUE(tty_speaks(pty.master(), format));
    EXPECT_TRUE(tty_speaks(pty.master(), {38000, 8, Parity::none, 1})) << "within 2 %";
    EXPECT_FALSE(tty_speaks(pty.master(), {19200, 8, Parity::none, 1}));
    EXPECT_FALSE(tty_speaks(pty.master(), {57600, 8, Parity::none, 1}));
}

TEST(TtySpeaks, DetectsOddParityButNotNoneFromEven) {
    const Pty pty;
    set_up_tty(pty.master(), {9600, 8, Parity::odd, 1});
    EXPECT_TRUE(tty_speaks(pty.master(), {9600, 8, Parity::odd, 1}));
    EXPECT_FALSE(tty_speaks(pty.master(), {9600, 8, Parity::even, 1}));
    set_up_tty(pty.master(), {9600, 8, Parity::even, 1});
    EXPECT_TRUE(tty_speaks(pty.master(), {9600, 8, Parity::none, 1}));
    EXPECT_FALSE(tty_speaks(pty.master(), {9600, 8, Parity::odd, 1}));
}

}  // namespace
}  // namespace panelgate::line::tty_speaks_test
