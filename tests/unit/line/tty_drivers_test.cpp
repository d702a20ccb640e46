// A serial line on scripted drivers that a pseudo-terminal cannot imitate.
#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "line_events.hpp"
#include "panelgate/line/pty.hpp"
#include "panelgate/line/tty_line.hpp"
#include "scripted_ops.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::line::tty_drivers_test {
namespace {

/// A pty cannot report when it is empty.
constexpr Duration kBlindMargin = 2ms;

class TtyDrivers : public testing::Test {
  protected:
    TtyDrivers() {
        settings.device = pty.path();
        settings.serial = {9600, 8, Parity::none, 1};
        settings.reopen_min = settings.reopen_max = 1h;
    }
    std::unique_ptr<Line> start() {
        auto line = make_tty_line(io.get_executor(), clock, settings, ops);
        line->start(heard);
        opened = line.get();
        return line;
    }
    void run_until(const std::function<bool()>& so) {
        ASSERT_TRUE(test::run_until(io, clock, so)) << "nothing is left to happen";
    }
    /// Records the levels of RTS, and how many bytes had been sent by then.
    void record_rts() {
        const auto switched = [this](int level) {
            return [this, level](void*) {
                const auto sent = opened == nullptr ? 0 : opened->counters().bytes_sent;
                rts.push_back({level, sent, clock.now()});
                return 0;
            };
        };
        ops.answers[TIOCMBIS] = switched(1);
        ops.answers[TIOCMBIC] = switched(0);
    }

    struct Switched {
        int level;
        std::uint64_t sent;
        TimePoint at;
    };
    boost::asio::io_context io{1};
    test::ManualClock clock;
    Pty pty;
    ScriptedOps ops;
    Settings settings;
    Heard heard;
    std::vector<Switched> rts;
    Line* opened = nullptr;
};

TEST_F(TtyDrivers, KernelModeIsSetAtEachOpening) {
    serial_rs485 kept{};
    ops.keep(TIOCSRS485, TIOCGRS485, kept);
    settings.rs485.mode = Rs485::Mode::kernel;
    settings.rs485.delay_before_send = 3ms;
    auto line = start();
    EXPECT_EQ(heard.ups, 1);
    EXPECT_EQ(kept.delay_rts_before_send, 3u);
    EXPECT_EQ(line->lead(), Duration(3ms));
}

TEST_F(TtyDrivers, KernelModeWithoutDriverSupportKeepsTheLineDownAndReportsWhy) {
    settings.rs485.mode = Rs485::Mode::kernel;
    auto line = start();
    EXPECT_EQ(heard.ups, 0);
    ASSERT_EQ(heard.downs.size(), 1u);
    EXPECT_EQ(heard.downs[0], "cannot open " + settings.device +
                                  ": its driver cannot switch RS-485 (TIOCSRS485); use rs485 mode "
                                  "off with an adapter that switches by itself, or mode rts");
}

TEST_F(TtyDrivers, RtsIsHighFromBeforeTheFirstBitToAfterTheLast) {
    record_rts();
    settings.rs485.mode = Rs485::Mode::rts;
    settings.rs485.delay_after_send = 2ms;
    auto line = start();
    ASSERT_EQ(rts.size(), 1u);
    EXPECT_EQ(rts[0].level, 0);  // listening
    const TimePoint begin = clock.now();
    line->write(Bytes(12, 0x55));
    run_until([&] { return rts.size() == 3; });
    EXPECT_EQ(rts[1].level, 1);
    EXPECT_EQ(rts[1].sent, 0u);
    EXPECT_EQ(rts[2].level, 0);
    EXPECT_EQ(rts[2].sent, 12u);
    EXPECT_EQ(rts[2].at - begin, wire_time(settings.serial, 12) + 2ms + kBlindMargin);
}

TEST_F(TtyDrivers, RtsLeadsByItsDelay) {
    record_rts();
    settings.rs485.mode = Rs485::Mode::rts;
    settings.rs485.delay_before_send = 5ms;
    auto line = start();
    EXPECT_EQ(line->lead(), Duration(5ms));
    line->write(Bytes(3, 0x55));
    EXPECT_EQ(rts.back().level, 1);
    run_until([&] { return rts.size() == 3; });
    EXPECT_EQ(rts[2].sent, 3u);
    EXPECT_EQ(rts[2].at - rts[1].at, 5ms + wire_time(settings.serial, 3) + kBlindMargin);
}

TEST_F(TtyDrivers, RtsStaysWhileTheDriverHasUnsentBytes) {
    record_rts();
    serial_struct uart{};
    uart.type = PORT_16550A;
    ops.give(TIOCGSERIAL, uart);
    ops.give(TIOCSERGETLSR, unsigned{TIOCSER_TEMT});
    std::deque<int> queue{0, 0, 7, 2};  // at opening, before the frame, then at each look
    ops.answers[TIOCOUTQ] = [&](void* argument) {
        *static_cast<int*>(argument) = queue.empty() ? 0 : queue.front();
        if (!queue.empty()) queue.pop_front();
        return 0;
    };
    settings.rs485.mode = Rs485::Mode::rts;
    auto line = start();
    line->write(Bytes(3, 0x55));
    run_until([&] { return rts.size() == 3; });
    EXPECT_TRUE(queue.empty());
    EXPECT_EQ(rts[2].at - rts[1].at,
              wire_time(settings.serial, 3) + (7 + 2) * character_time(settings.serial));
}

TEST_F(TtyDrivers, RtsWithoutSuchAPinKeepsTheLineDown) {
    settings.rs485.mode = Rs485::Mode::rts;  // a pty has none
    auto line = start();
    EXPECT_EQ(heard.ups, 0);
    ASSERT_EQ(heard.downs.size(), 1u);
    EXPECT_NE(heard.downs[0].find("no RTS"), std::string::npos) << heard.downs[0];
}

TEST_F(TtyDrivers, P7AnAdapterThatGoesBetweenRtsAndTheFrameTakesTheLineDownOnce) {
    record_rts();
    settings.rs485.mode = Rs485::Mode::rts;
    auto line = start();
    ops.refuse(TIOCMBIS, EIO);
    line->write(Bytes(3, 0x55));
    EXPECT_EQ(heard.downs.size(), 1u);
    line->write(Bytes(3, 0x55));  // down: nothing happens
    EXPECT_EQ(heard.downs.size(), 1u);
}

TEST_F(TtyDrivers, ReportsUnsentBytes) {
    serial_struct adapter{};  // on USB: PORT_UNKNOWN
    ops.give(TIOCGSERIAL, adapter);
    ops.give(TIOCOUTQ, 4);
    auto line = start();
    EXPECT_EQ(line->unsent(), 4 * character_time(settings.serial));
    line->stop();
    EXPECT_EQ(line->unsent(), std::nullopt);
}

TEST_F(TtyDrivers, APtyCannotReportIt) { EXPECT_EQ(start()->unsent(), std::nullopt); }

TEST_F(TtyDrivers, ShowsTheDriversErrorCounters) {
    serial_icounter_struct counts{};
    ops.give(TIOCGICOUNT, counts);
    auto line = start();
    counts.frame = 3;
    counts.overrun = 1;
    counts.buf_overrun = 1;
    ops.give(TIOCGICOUNT, counts);
    EXPECT_EQ(line->counters().uart, (UartErrors{3, 0, 2, 0}));
    line->stop();
    EXPECT_EQ(line->counters().uart, (UartErrors{3, 0, 2, 0}));
}

TEST_F(TtyDrivers, ChangesItsFormatWhileItIsOpen) {
    auto line = start();
    EXPECT_TRUE(line->set_format({115200, 8, Parity::none, 2}));
    ops.refuse(ops.asked[1], EIO);  // TCGETS2, after TIOCEXCL: the device is gone
    EXPECT_FALSE(line->set_format({9600, 8, Parity::none, 1}));
    EXPECT_EQ(heard.downs.size(), 1u);
}

}  // namespace
}  // namespace panelgate::line::tty_drivers_test
