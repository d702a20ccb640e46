// The serial code on recorded answers of real drivers (tests/kernel).
#include <gtest/gtest.h>

#include "driver.hpp"
#include "panelgate/line/termios_setup.hpp"
#include "recorded_ops.hpp"
#include "rs485.hpp"

namespace panelgate::line::recorded_test {
namespace {

constexpr int kNoDevice = -1;
constexpr SerialFormat kEven{19200, 8, Parity::even, 1};
constexpr SerialFormat kFast{250'000, 8, Parity::none, 1};

struct Answers {
    const char* driver;
    const char* error;         ///< how set_up_tty() fails, for every format
    const char* even_warning;  ///< of 19200 8E1
    const char* fast_warning;  ///< of 250000 8N1
    bool switches_rts;
    bool tells_queue;
    bool tells_empty;
    bool counts_errors;
};

constexpr Answers kRecorded[] = {
    {"8250", "", "", "the driver made 12345 bit/s of 250000", true, true, true, true},
    {"ftdi", "", "", "", true, true, false, true},
    {"pty", "", "parity was not taken", "", false, false, false, false},
    {"absent", "there is no UART behind it: Input/output error", "", "", false, false, false, true},
    {"gone", "there is no UART behind it: Input/output error", "", "", false, false, false, false},
};

class Recorded : public testing::TestWithParam<Answers> {
  protected:
    RecordedOps ops{GetParam().driver};
};

TEST_P(Recorded, IsThere) { EXPECT_FALSE(ops.is_empty()); }

TEST_P(Recorded, TakesItsSettingsOrReportsWhatItDidNotTake) {
    const auto even = set_up_tty(kNoDevice, kEven, ops);
    EXPECT_EQ(even.error, GetParam().error);
    EXPECT_EQ(even.warning, GetParam().even_warning);
    EXPECT_EQ(set_up_tty(kNoDevice, kFast, ops).warning, GetParam().fast_warning);
}

TEST_P(Recorded, CannotSwitchRs485ByItself) {
    Rs485 settings;
    settings.mode = Rs485::Mode::kernel;
    const auto result = set_up_rs485(kNoDevice, settings, ops);
    EXPECT_NE(result.error, "");
    EXPECT_NE(result.error.find("use rs485 mode off"), std::string::npos) << result.error;
}

TEST_P(Recorded, SwitchesRtsOrReportsThatItCannot) {
    Rs485 settings;
    settings.mode = Rs485::Mode::rts;
    EXPECT_EQ(switch_rts(kNoDevice, settings, true, ops).empty(), GetParam().switches_rts);
    EXPECT_EQ(switch_rts(kNoDevice, settings, false, ops).empty(), GetParam().switches_rts);
}

TEST_P(Recorded, ReportsItsFeatures) {
    const Driver driver = look_at_driver(kNoDevice, ops);
    EXPECT_EQ(driver.tells_queue, GetParam().tells_queue);
    EXPECT_EQ(driver.tells_empty, GetParam().tells_empty);
    EXPECT_EQ(unsent_time(kNoDevice, driver, 1ms, ops), Duration::zero());  // it was idle
    UartErrorCount errors;
    errors.opened(kNoDevice, ops);
    EXPECT_EQ(errors.look(kNoDevice, ops).has_value(), GetParam().counts_errors);
}

INSTANTIATE_TEST_SUITE_P(Drivers, Recorded, testing::ValuesIn(kRecorded),
                         [](const auto& test) { return std::string(test.param.driver); });

}  // namespace
}  // namespace panelgate::line::recorded_test
