#include "driver.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "scripted_ops.hpp"
#include "support/temp_dir.hpp"

namespace panelgate::line::driver_test {
namespace {

constexpr int kNoDevice = -1;

serial_struct of_type(int type) {
    serial_struct info{};
    info.type = type;
    return info;
}

TEST(Driver, APseudoTerminalReportsNothing) {
    ScriptedOps ops;
    ops.give(TIOCOUTQ, 5);
    const Driver driver = look_at_driver(kNoDevice, ops);
    EXPECT_FALSE(driver.tells_queue);
    EXPECT_FALSE(driver.tells_empty);
    EXPECT_EQ(unsent_time(kNoDevice, driver, 1ms, ops), Duration::zero());
}

TEST(Driver, ARealUartReportsQueueAndShiftRegister) {
    ScriptedOps ops;
    ops.give(TIOCGSERIAL, of_type(PORT_16550A));
    ops.give(TIOCOUTQ, 5);
    ops.give(TIOCSERGETLSR, 0u);
    const Driver driver = look_at_driver(kNoDevice, ops);
    EXPECT_TRUE(driver.tells_queue);
    EXPECT_TRUE(driver.tells_empty);
    EXPECT_EQ(unsent_time(kNoDevice, driver, 1ms, ops), Duration(6ms));
    ops.give(TIOCOUTQ, 0);
    EXPECT_EQ(unsent_time(kNoDevice, driver, 1ms, ops), Duration(1ms));
    ops.give(TIOCSERGETLSR, unsigned{TIOCSER_TEMT});
    EXPECT_EQ(unsent_time(kNoDevice, driver, 1ms, ops), Duration::zero());
}

TEST(Driver, AnAdapterOnUsbIsNotAskedForWhatWouldBlock) {
    ScriptedOps ops;  // as ftdi_sio: TIOCSERGETLSR is a control message on the bus
    ops.give(TIOCGSERIAL, of_type(PORT_UNKNOWN));
    ops.give(TIOCOUTQ, 3);
    ops.give(TIOCSERGETLSR, 0u);
    const Driver driver = look_at_driver(kNoDevice, ops);
    EXPECT_EQ(unsent_time(kNoDevice, driver, 1ms, ops), Duration(3ms));
    EXPECT_EQ(std::ranges::count(ops.asked, static_cast<unsigned long>(TIOCSERGETLSR)), 0);
}

TEST(Driver, ADeviceThatGoesMeanwhileHasNothingLeftToSend) {
    ScriptedOps ops;
    ops.refuse(TIOCOUTQ, EIO);
    ops.refuse(TIOCSERGETLSR, EIO);
    EXPECT_EQ(unsent_time(kNoDevice, {true, true}, 1ms, ops), Duration::zero());
}

class LowLatency : public testing::Test {
  protected:
    LowLatency() {
        device = sysfs / "ttyUSB7";
        std::ofstream(device) << "";
        std::filesystem::create_symlink(device, sysfs / "by-id");
        timer = sysfs / "class/tty/ttyUSB7/device/latency_timer";
    }
    void has_timer(int ms) {
        std::filesystem::create_directories(timer.parent_path());
        std::ofstream(timer) << ms << '\n';
    }
    int timer_now() const {
        int ms = 0;
        std::ifstream(timer) >> ms;
        return ms;
    }
    std::string ask() { return ask_low_latency(kNoDevice, sysfs / "by-id", ops, sysfs); }

    ScriptedOps ops;
    const test::TempDir folder;
    const std::filesystem::path& sysfs = folder.path();
    std::filesystem::path device;
    std::filesystem::path timer;
};

TEST_F(LowLatency, IsAskedOfTheDriver) {
    serial_struct kept = of_type(PORT_16550A);
    ops.keep(TIOCSSERIAL, TIOCGSERIAL, kept);
    EXPECT_EQ(ask(), "");
    EXPECT_NE(static_cast<unsigned>(kept.flags) & ASYNC_LOW_LATENCY, 0u);
}

TEST_F(LowLatency, IsWrittenToTheAdaptersTimerBehindEveryLink) {
    has_timer(16);
    EXPECT_EQ(ask(), "");
    EXPECT_EQ(timer_now(), 1);
}

TEST_F(LowLatency, IsNeverFatalAndReportsWhatToAllow) {
    // A file that not even root may write.
    std::filesystem::create_directories(timer.parent_path());
    std::filesystem::create_symlink("/proc/sys/kernel/cap_last_cap", timer);
    EXPECT_EQ(ask(), "the adapter keeps received bytes for up to " + std::to_string(timer_now()) +
                         " ms; let this user write " + timer.string() +
                         " (deploy/udev has a rule)");
}

TEST_F(LowLatency, IsNoMatterForDevicesWithoutIt) { EXPECT_EQ(ask(), ""); }

serial_icounter_struct counts(int frame, int parity, int overrun, int buffer, int brk) {
    serial_icounter_struct c{};
    c.frame = frame;
    c.parity = parity;
    c.overrun = overrun;
    c.buf_overrun = buffer;
    c.brk = brk;
    return c;
}

TEST(UartErrorCount, CountsFromTheFirstOpeningOverAllOthers) {
    ScriptedOps ops;
    UartErrorCount errors;
    ops.give(TIOCGICOUNT, counts(100, 50, 7, 3, 1));  // before this program opened it
    errors.opened(kNoDevice, ops);
    EXPECT_EQ(errors.look(kNoDevice, ops), UartErrors{});
    ops.give(TIOCGICOUNT, counts(101, 52, 8, 5, 5));
    EXPECT_EQ(errors.look(kNoDevice, ops), (UartErrors{1, 2, 3, 4}));
    ops.give(TIOCGICOUNT, counts(0, 0, 0, 0, 0));  // plugged in again: another port
    errors.opened(kNoDevice, ops);
    ops.give(TIOCGICOUNT, counts(1, 0, 0, 0, 0));
    EXPECT_EQ(errors.look(kNoDevice, ops), (UartErrors{2, 2, 3, 4}));
    ops.refuse(TIOCGICOUNT, EIO);
    EXPECT_EQ(errors.look(kNoDevice, ops), (UartErrors{2, 2, 3, 4}));
    EXPECT_EQ(errors.last(), (UartErrors{2, 2, 3, 4}));
}

TEST(UartErrorCount, SurvivesTheDriversWrap) {
    ScriptedOps ops;
    UartErrorCount errors;
    ops.give(TIOCGICOUNT, counts(-1, 0, 0, 0, 0));  // 2^32 - 1
    errors.opened(kNoDevice, ops);
    ops.give(TIOCGICOUNT, counts(1, 0, 0, 0, 0));
    EXPECT_EQ(errors.look(kNoDevice, ops)->framing, 2u);
}

TEST(UartErrorCount, IsNothingWhereTheDriverDoesNotCount) {
    ScriptedOps ops;
    UartErrorCount errors;
    errors.opened(kNoDevice, ops);
    EXPECT_EQ(errors.look(kNoDevice, ops), std::nullopt);
}

}  // namespace
}  // namespace panelgate::line::driver_test
