// A serial line on scripted drivers that a pseudo-terminal cannot imitate. P1: a device that does
// not take written bytes, or keeps them.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <linux/serial.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <cerrno>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "line_events.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/line/pty.hpp"
#include "panelgate/line/tty_line.hpp"
#include "scripted_ops.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::line::tty_drivers_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A pty cannot report when it is empty.
constexpr Duration kBlindMargin = 2ms;
constexpr std::uintptr_t kOutput = 1;  // TCOFLUSH: <termios.h> clashes with <asm/termios.h>
constexpr std::uintptr_t kStop = 0;    // TCOOFF

class TtyDrivers : public testing::Test {
  protected:
    TtyDrivers() {
        settings.device = pty.path();
        settings.serial = {9600, 8, Parity::none, 1};
        settings.reopen_min = 1ms;
        ops.answers[TCFLSH] = [this](void* argument) {
            flushed.push_back(reinterpret_cast<std::uintptr_t>(argument));
            if (flushed.back() == kOutput && drops) queue = 0;
            return 0;
        };
    }
    void start() {
        line.reset();
        rts.clear();
        auto made = make_tty_line(io.get_executor(), clock, settings, ops);
        made->start(heard);
        line = std::move(made);
        flushed.clear();
    }
    void write(std::size_t bytes) { line->write(Bytes(bytes, 0x55)); }
    void run_until(const std::function<bool()>& so) {
        const TimePoint end = clock.now() + 1min;
        while (!so()) {
            ASSERT_LT(clock.now(), end) << "nothing is left to happen";
            io.restart();
            if (io.poll_one() == 0) clock.advance(1ms);  // some of it comes with time alone
        }
    }
    /// The line was reset once, its output discarded.
    void expect_reset(const std::string& why) {
        EXPECT_THAT(heard.downs, ElementsAre(settings.device + " is opened anew: " + why));
        EXPECT_THAT(flushed, ElementsAre(kOutput));
    }
    /// Like a USB adapter: PORT_UNKNOWN.
    void report_queue() {
        ops.give(TIOCGSERIAL, serial_struct{});
        ops.answers[TIOCOUTQ] = [this](void* argument) {
            *static_cast<int*>(argument) = queue;
            return 0;
        };
    }
    /// RTS mode; records its levels, and how many bytes had been sent by then.
    void record_rts() {
        settings.rs485.mode = Rs485::Mode::rts;
        const auto switched = [this](int level) {
            return [this, level](void*) {
                rts.push_back({level, line ? line->counters().bytes_sent : 0, clock.now()});
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
    std::vector<std::uintptr_t> flushed;
    int queue = 0;
    bool drops = true;  ///< a flush empties the queue
    std::unique_ptr<Line> line;
};

TEST_F(TtyDrivers, KernelModeIsSetAtEachOpening) {
    serial_rs485 kept{};
    ops.keep(TIOCSRS485, TIOCGRS485, kept);
    settings.rs485.mode = Rs485::Mode::kernel;
    settings.rs485.delay_before_send = 3ms;
    start();
    EXPECT_EQ(heard.ups, 1);
    EXPECT_EQ(kept.delay_rts_before_send, 3u);
    EXPECT_EQ(line->lead(), Duration(3ms));
}

TEST_F(TtyDrivers, AModeThatTheDriverLacksKeepsTheLineDownAndReportsWhy) {
    const std::pair<Rs485::Mode, std::string> modes[] = {
        {Rs485::Mode::kernel, "its driver cannot switch RS-485"},
        {Rs485::Mode::rts, "it has no RTS"},
    };
    for (const auto& [mode, why] : modes) {
        settings.rs485.mode = mode;
        heard.downs.clear();
        start();
        EXPECT_EQ(heard.ups, 0);
        EXPECT_THAT(heard.downs,
                    ElementsAre(HasSubstr("cannot open " + settings.device + ": " + why)));
    }
}

TEST_F(TtyDrivers, RtsIsHighFromBeforeTheFirstBitToAfterTheLast) {
    record_rts();
    const std::pair<Duration, Duration> delays[] = {{0ms, 2ms}, {5ms, 0ms}};
    for (const auto& [before, after] : delays) {
        settings.rs485.delay_before_send = before;
        settings.rs485.delay_after_send = after;
        start();
        ASSERT_EQ(rts.size(), 1u);
        EXPECT_EQ(rts[0].level, 0);  // listening
        EXPECT_EQ(line->lead(), before);
        const TimePoint begin = clock.now();
        write(12);
        ASSERT_EQ(rts.size(), 2u);
        EXPECT_EQ(rts[1].level, 1);
        EXPECT_EQ(rts[1].sent, 0u);
        run_until([&] { return rts.size() == 3; });
        EXPECT_EQ(rts[2].level, 0);
        EXPECT_EQ(rts[2].sent, 12u);
        EXPECT_EQ(rts[2].at - begin,
                  before + wire_time(settings.serial, 12) + after + kBlindMargin);
    }
}

TEST_F(TtyDrivers, RtsStaysWhileTheDriverHasUnsentBytes) {
    record_rts();
    serial_struct uart{};
    uart.type = PORT_16550A;
    ops.give(TIOCGSERIAL, uart);
    ops.give(TIOCSERGETLSR, unsigned{TIOCSER_TEMT});
    std::deque<int> queued{0, 0, 7, 2};  // at opening, before the frame, then at each look
    ops.answers[TIOCOUTQ] = [&](void* argument) {
        *static_cast<int*>(argument) = queued.empty() ? 0 : queued.front();
        if (!queued.empty()) queued.pop_front();
        return 0;
    };
    start();
    write(3);
    run_until([&] { return rts.size() == 3; });
    EXPECT_THAT(queued, IsEmpty());
    EXPECT_EQ(rts[2].at - rts[1].at,
              wire_time(settings.serial, 3) + (7 + 2) * character_time(settings.serial));
    line.reset();
}

TEST_F(TtyDrivers, P7AnAdapterThatGoesBetweenRtsAndTheFrameTakesTheLineDownOnce) {
    record_rts();
    start();
    ops.refuse(TIOCMBIS, EIO);
    for (int i = 0; i < 2; ++i) {
        write(3);  // the second time it is down: nothing happens
        EXPECT_EQ(heard.downs.size(), 1u);
    }
}

TEST_F(TtyDrivers, AResetLeavesTheTransceiverListening) {
    record_rts();
    start();
    write(8);
    EXPECT_EQ(rts.back().level, 1);
    line->reset("the request was not taken");
    EXPECT_EQ(rts.back().level, 0);
}

TEST_F(TtyDrivers, ReportsUnsentBytes) {
    start();
    EXPECT_EQ(line->unsent(), std::nullopt) << "a pty cannot report it";
    report_queue();
    start();
    queue = 4;
    EXPECT_EQ(line->unsent(), 4 * character_time(settings.serial));
    line->stop();
    EXPECT_EQ(line->unsent(), std::nullopt);
}

TEST_F(TtyDrivers, ShowsTheDriversErrorCounters) {
    serial_icounter_struct counts{};
    ops.give(TIOCGICOUNT, counts);
    start();
    counts.frame = 3;
    counts.overrun = 1;
    counts.buf_overrun = 1;
    ops.give(TIOCGICOUNT, counts);
    EXPECT_EQ(line->counters().uart, (UartErrors{3, 0, 2, 0}));
    line->stop();
    EXPECT_EQ(line->counters().uart, (UartErrors{3, 0, 2, 0}));
}

TEST_F(TtyDrivers, ChangesItsFormatWhileItIsOpen) {
    start();
    EXPECT_TRUE(line->set_format({115200, 8, Parity::none, 2}));
    ops.refuse(TCGETS2, EIO);  // the device is gone
    EXPECT_FALSE(line->set_format({9600, 8, Parity::none, 1}));
    EXPECT_EQ(heard.downs.size(), 1u);
}

TEST_F(TtyDrivers, P1ADeviceThatIsFullIsOpenedAnewAndKeepsNoFrames) {
    start();
    unsigned frames = 0;
    for (; !line->undelivered() && frames < 10'000; ++frames) write(256);
    EXPECT_THAT(heard.downs, IsEmpty());
    EXPECT_TRUE(line->undelivered());
    write(256);
    expect_reset("the device takes nothing");
    EXPECT_EQ(line->counters().bytes_sent, 256u * frames);
    run_until([&] { return heard.ups == 2; });
    EXPECT_FALSE(line->undelivered());
}

TEST_F(TtyDrivers, P1OutputThatWasStoppedIsUndelivered) {
    const int user = ::open(pty.path().c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
    ASSERT_EQ(kernel_ops().control(user, TCXONC, reinterpret_cast<void*>(kStop)), 0);
    start();
    EXPECT_FALSE(line->undelivered());
    write(3);
    EXPECT_TRUE(line->undelivered());
    line->reset("the request was not taken");
    expect_reset("the request was not taken");
    ::close(user);
}

TEST_F(TtyDrivers, P1AQueueThatDoesNotEmptyIsUndeliveredWhenItsTimeIsOver) {
    report_queue();
    settings.serial.baud = 300;
    start();
    EXPECT_FALSE(line->undelivered());
    const TimePoint begin = clock.now();
    write(256);
    queue = 256;
    EXPECT_FALSE(line->undelivered());
    run_until([&] { return line->undelivered(); });
    EXPECT_GE(clock.now() - begin, wire_time(settings.serial, 256));  // 8.5 s
    EXPECT_THAT(heard.downs, IsEmpty());
    write(8);
    expect_reset("the device takes nothing");
}

TEST_F(TtyDrivers, P1AQueueThatEmptiesIsDelivered) {
    report_queue();
    start();
    for (int i = 0; i < 3; ++i) {
        write(8);
        queue = 8;
        run_until([&] { return line->undelivered(); });
        queue = 0;
        EXPECT_FALSE(line->undelivered());
    }
    line->stop();
    EXPECT_THAT(heard.downs, IsEmpty());
    EXPECT_THAT(flushed, IsEmpty());
}

TEST_F(TtyDrivers, P1FramesThatFollowEachOtherDoNotHideAQueueThatDoesNotEmpty) {
    report_queue();
    start();
    for (const TimePoint end = clock.now() + 10s; heard.downs.empty() && clock.now() < end;) {
        write(8);
        queue += 8;
        clock.advance(1ms);
    }
    EXPECT_THAT(heard.downs,
                ElementsAre(settings.device + " is opened anew: the device takes nothing"));
}

TEST_F(TtyDrivers, ADriverThatKeepsDiscardedBytesIsStillClosed) {
    report_queue();
    drops = false;
    start();
    write(8);
    queue = 8;
    line->reset("the request was not taken");
    ASSERT_EQ(heard.downs.size(), 1u);
    run_until([&] { return heard.ups == 2; });
}

}  // namespace
}  // namespace panelgate::line::tty_drivers_test
