// What drivers differ in: scripted ones, and recorded answers of real ones (tests/kernel).
#include "driver.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/line/termios_setup.hpp"
#include "rs485.hpp"
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
    std::string ask() { return ask_low_latency(kNoDevice, sysfs / "by-id", ops, sysfs); }
    std::string timer_now() const {
        std::string ms;
        std::ifstream(timer) >> ms;
        return ms;
    }

    ScriptedOps ops;
    const test::TempDir folder;
    const std::filesystem::path& sysfs = folder.path();
    std::filesystem::path device;
    std::filesystem::path timer;
};

TEST_F(LowLatency, IsAskedOfTheDriverAndIsNoMatterForDevicesWithoutIt) {
    EXPECT_EQ(ask(), "");
    serial_struct kept = of_type(PORT_16550A);
    ops.keep(TIOCSSERIAL, TIOCGSERIAL, kept);
    EXPECT_EQ(ask(), "");
    EXPECT_NE(static_cast<unsigned>(kept.flags) & ASYNC_LOW_LATENCY, 0u);
}

TEST_F(LowLatency, IsWrittenToTheAdaptersTimerBehindEveryLink) {
    std::filesystem::create_directories(timer.parent_path());
    std::ofstream(timer) << 16 << '\n';
    EXPECT_EQ(ask(), "");
    EXPECT_EQ(timer_now(), "1");
}

TEST_F(LowLatency, IsNeverFatalAndReportsWhatToAllow) {
    // A file that not even root may write.
    std::filesystem::create_directories(timer.parent_path());
    std::filesystem::create_symlink("/proc/sys/kernel/cap_last_cap", timer);
    EXPECT_EQ(ask(), "the adapter keeps received bytes for up to " + timer_now() +
                         " ms; let this user write " + timer.string() +
                         " (deploy/udev has a rule)");
}

class UartErrorCounts : public testing::Test {
  protected:
    void count(int frame, int parity, int overrun, int buffer, int brk) {
        serial_icounter_struct counts{};
        counts.frame = frame;
        counts.parity = parity;
        counts.overrun = overrun;
        counts.buf_overrun = buffer;
        counts.brk = brk;
        ops.give(TIOCGICOUNT, counts);
    }
    std::optional<UartErrors> look() { return errors.look(kNoDevice, ops); }

    ScriptedOps ops;
    UartErrorCount errors;
};

TEST_F(UartErrorCounts, CountFromTheFirstOpeningOverAllOthers) {
    count(100, 50, 7, 3, 1);  // before this program opened it
    errors.opened(kNoDevice, ops);
    EXPECT_EQ(look(), UartErrors{});
    count(101, 52, 8, 5, 5);
    EXPECT_EQ(look(), (UartErrors{1, 2, 3, 4}));
    count(0, 0, 0, 0, 0);  // plugged in again: another port
    errors.opened(kNoDevice, ops);
    count(1, 0, 0, 0, 0);
    EXPECT_EQ(look(), (UartErrors{2, 2, 3, 4}));
    ops.refuse(TIOCGICOUNT, EIO);
    EXPECT_EQ(look(), (UartErrors{2, 2, 3, 4}));
    EXPECT_EQ(errors.last(), (UartErrors{2, 2, 3, 4}));
}

TEST_F(UartErrorCounts, SurviveTheDriversWrap) {
    count(-1, 0, 0, 0, 0);  // 2^32 - 1
    errors.opened(kNoDevice, ops);
    count(1, 0, 0, 0, 0);
    EXPECT_EQ(look()->framing, 2u);
}

/// Replays the answers of a real driver: tests/kernel/recorded/NAME.txt, whose format is described
/// in tests/kernel/README.md. What was not recorded is -ENOSYS.
class RecordedOps final : public PortOps {
  public:
    explicit RecordedOps(const std::string& name) {
        std::ifstream in(std::string(SOURCE_ROOT) + "/tests/kernel/recorded/" + name + ".txt");
        std::string line;
        while (std::getline(in, line)) {
            if (!line.empty() && line[0] != '#') rows_.push_back(row_of(line));
        }
        EXPECT_FALSE(rows_.empty());
    }

    int control(int, unsigned long request, void* argument) override {
        switch (request) {
            case TCGETS2:
                return report_settings(*static_cast<termios2*>(argument));
            case TCSETS2:
                return take_settings(*static_cast<termios2*>(argument));
            case TIOCGSERIAL:
                return report_driver(*static_cast<serial_struct*>(argument));
            case TIOCOUTQ:
                return tell(row("TIOCOUTQ"), "value", *static_cast<int*>(argument));
            case TIOCSERGETLSR:
                return tell(row("TIOCSERGETLSR"), "bits", *static_cast<unsigned*>(argument));
            default:
                return row(name_of(request)).result;
        }
    }

  private:
    struct Row {
        std::string request;
        std::string asked;
        int result = -ENOSYS;
        std::map<std::string, std::uint32_t> answer;
    };

    static int result_of(const std::string& text) {
        static const std::map<std::string, int> kErrors{
            {"-ENOTTY", -ENOTTY}, {"-EIO", -EIO}, {"-EINVAL", -EINVAL}};
        const auto error = kErrors.find(text);
        return error == kErrors.end() ? std::stoi(text) : error->second;
    }
    static Row row_of(const std::string& line) {
        std::istringstream in(line);
        Row row;
        std::string result;
        std::string answer;
        in >> row.request >> row.asked >> result >> answer;
        row.result = result_of(result);
        std::istringstream fields(answer);
        std::string field;
        while (std::getline(fields, field, ',')) {
            const std::size_t equals = field.find('=');
            if (equals == std::string::npos) continue;
            const auto value = std::stoull(field.substr(equals + 1), nullptr, 0);
            row.answer[field.substr(0, equals)] = static_cast<std::uint32_t>(value);
        }
        return row;
    }
    static std::string name_of(unsigned long request) {
        static const std::map<unsigned long, std::string> kNames{{TIOCSSERIAL, "TIOCSSERIAL"},
                                                                 {TIOCGRS485, "TIOCGRS485"},
                                                                 {TIOCSRS485, "TIOCSRS485"},
                                                                 {TIOCMBIS, "TIOCMBIS"},
                                                                 {TIOCMBIC, "TIOCMBIC"},
                                                                 {TIOCGICOUNT, "TIOCGICOUNT"},
                                                                 {TCFLSH, "TCFLSH"}};
        const auto name = kNames.find(request);
        return name == kNames.end() ? "" : name->second;
    }
    template <class Value>
    static int tell(const Row& row, const char* field, Value& value) {
        if (row.result >= 0) value = static_cast<Value>(row.answer.at(field));
        return row.result;
    }
    /// The first recorded row of a request; an empty `asked` matches any argument.
    const Row& row(const std::string& request, const std::string& asked = {}) const {
        static const Row kNone;
        const auto found = std::ranges::find_if(rows_, [&](const Row& one) {
            return one.request == request && (asked.empty() || one.asked == asked);
        });
        return found == rows_.end() ? kNone : *found;
    }

    int report_settings(termios2& t) const {
        const Row* told = &row("TCGETS2");
        for (std::size_t i = 0; i + 1 < rows_.size() && !set_.empty(); ++i) {
            if (rows_[i].request == "TCSETS2" && rows_[i].asked == set_) told = &rows_[i + 1];
        }
        tell(*told, "cflag", t.c_cflag);
        tell(*told, "ospeed", t.c_ospeed);
        return tell(*told, "ispeed", t.c_ispeed);
    }
    int take_settings(const termios2& t) {
        SerialFormat format;
        format.baud = static_cast<int>(t.c_ospeed);
        format.stop_bits = (t.c_cflag & CSTOPB) != 0 ? 2 : 1;
        format.parity = Parity::none;
        if ((t.c_cflag & PARENB) != 0)
            format.parity = (t.c_cflag & PARODD) != 0 ? Parity::odd : Parity::even;
        set_ = to_string(format);  // "19200 8E1", recorded as 19200-8E1
        set_[set_.find(' ')] = '-';
        return row("TCSETS2", set_).result;
    }
    int report_driver(serial_struct& info) const {
        tell(row("TIOCGSERIAL"), "type", info.type);
        return tell(row("TIOCGSERIAL"), "flags", info.flags);
    }

    std::vector<Row> rows_;
    std::string set_;
};

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

TEST_P(Recorded, TakesItsSettingsOrReportsWhatItDidNotTake) {
    const auto even = set_up_tty(kNoDevice, {19200, 8, Parity::even, 1}, ops);
    EXPECT_EQ(even.error, GetParam().error);
    EXPECT_EQ(even.warning, GetParam().even_warning);
    const auto fast = set_up_tty(kNoDevice, {250'000, 8, Parity::none, 1}, ops);
    EXPECT_EQ(fast.warning, GetParam().fast_warning);
}

TEST_P(Recorded, CannotSwitchRs485ByItselfAndSwitchesRtsOrReportsThatItCannot) {
    Rs485 settings;
    settings.mode = Rs485::Mode::kernel;
    const std::string error = set_up_rs485(kNoDevice, settings, ops).error;
    EXPECT_NE(error.find("use rs485 mode off"), std::string::npos) << error;
    settings.mode = Rs485::Mode::rts;
    for (const bool sending : {true, false})
        EXPECT_EQ(switch_rts(kNoDevice, settings, sending, ops).empty(), GetParam().switches_rts);
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
}  // namespace panelgate::line::driver_test
