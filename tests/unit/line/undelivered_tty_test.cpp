// P1: a device that does not take written bytes, or keeps them, and what happens to them.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/serial.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <cerrno>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "line_events.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/line/pty.hpp"
#include "panelgate/line/tty_line.hpp"
#include "scripted_ops.hpp"
#include "support/manual_clock.hpp"
#include "tty_trouble.hpp"

namespace panelgate::line::undelivered_tty_test {
namespace {

constexpr std::uintptr_t kOutput = 1;  // TCOFLUSH: <termios.h> clashes with <asm/termios.h>
constexpr std::uintptr_t kStop = 0;    // TCOOFF

class UndeliveredTty : public testing::Test {
  protected:
    UndeliveredTty() {
        settings.device = pty.path();
        settings.serial = {38400, 8, Parity::none, 1};
        settings.reopen_min = 1ms;
        ops.answers[TCFLSH] = [this](void* argument) {
            flushed.push_back(reinterpret_cast<std::uintptr_t>(argument));
            if (reinterpret_cast<std::uintptr_t>(argument) == kOutput && drops) queue = 0;
            return 0;
        };
    }
    std::unique_ptr<Line> start() {
        auto line = make_tty_line(io.get_executor(), clock, settings, ops);
        line->start(heard);
        flushed.clear();
        return line;
    }
    /// Like a USB adapter.
    void report_queue() {
        ops.give(TIOCGSERIAL, serial_struct{});
        ops.answers[TIOCOUTQ] = [this](void* argument) {
            *static_cast<int*>(argument) = queue;
            return 0;
        };
    }
    void run_until(const std::function<bool()>& so) {
        while (!so()) {
            io.restart();
            if (io.poll_one() == 0) clock.advance(1ms);  // some of it comes with time alone
        }
    }

    boost::asio::io_context io{1};
    test::ManualClock clock;
    Pty pty;
    ScriptedOps ops;
    Settings settings;
    Heard heard;
    std::vector<std::uintptr_t> flushed;
    int queue = 0;
    bool drops = true;
};

TEST_F(UndeliveredTty, ADeviceThatIsFullIsOpenedAnewAndKeepsNoFrames) {
    auto line = start();
    const Bytes frame(256, 0x55);
    int frames = 0;
    while (!line->undelivered() && frames < 10'000) {
        line->write(frame);
        ++frames;
    }
    EXPECT_TRUE(heard.downs.empty());
    EXPECT_TRUE(line->undelivered());
    line->write(frame);
    ASSERT_EQ(heard.downs.size(), 1u);
    EXPECT_EQ(heard.downs[0], settings.device + " is opened anew: the device takes nothing");
    EXPECT_EQ(flushed, std::vector{kOutput});
    EXPECT_EQ(line->counters().bytes_sent, 256u * static_cast<unsigned>(frames));
    run_until([&] { return heard.ups == 2; });
    EXPECT_FALSE(line->undelivered());
}

TEST_F(UndeliveredTty, OutputThatWasStoppedIsUndelivered) {
    const int user = ::open(pty.path().c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
    ASSERT_EQ(kernel_ops().control(user, TCXONC, reinterpret_cast<void*>(kStop)), 0);
    auto line = start();
    EXPECT_FALSE(line->undelivered());
    line->write(Bytes{1, 2, 3});
    EXPECT_TRUE(line->undelivered());
    line->reset("the request was not taken");
    ASSERT_EQ(heard.downs.size(), 1u);
    EXPECT_EQ(heard.downs[0], settings.device + " is opened anew: the request was not taken");
    EXPECT_EQ(flushed, std::vector{kOutput});
    ::close(user);
}

TEST_F(UndeliveredTty, AQueueThatDoesNotEmptyIsUndelivered) {
    report_queue();
    auto line = start();
    EXPECT_FALSE(line->undelivered());
    const TimePoint begin = clock.now();
    line->write(Bytes(8, 0x55));
    queue = 8;
    run_until([&] { return line->undelivered(); });
    EXPECT_GE(clock.now() - begin, wire_time(settings.serial, 8));
    EXPECT_TRUE(heard.downs.empty());
    line->write(Bytes(8, 0x55));
    ASSERT_EQ(heard.downs.size(), 1u);
    EXPECT_EQ(heard.downs[0], settings.device + " is opened anew: the device takes nothing");
    EXPECT_EQ(flushed, std::vector{kOutput});
}

TEST_F(UndeliveredTty, WhatIsBeingSentIsNotUndelivered) {
    report_queue();
    settings.serial.baud = 300;
    auto line = start();
    line->write(Bytes(256, 0x55));  // it takes 8.5 s
    queue = 256;
    EXPECT_FALSE(line->undelivered());
}

TEST_F(UndeliveredTty, AQueueThatEmptiesIsDelivered) {
    report_queue();
    auto line = start();
    for (int i = 0; i < 3; ++i) {
        line->write(Bytes(8, 0x55));
        queue = 8;
        run_until([&] { return line->undelivered(); });
        queue = 0;
        EXPECT_FALSE(line->undelivered());
    }
    line->stop();
    EXPECT_TRUE(heard.downs.empty());
    EXPECT_TRUE(flushed.empty());
}

TEST_F(UndeliveredTty, FramesThatFollowEachOtherDoNotHideAQueueThatDoesNotEmpty) {
    report_queue();
    auto line = start();
    line->write(Bytes(8, 0x55));
    queue = 8;
    run_until([&] {
        if (!heard.downs.empty()) return true;
        line->write(Bytes(8, 0x55));
        queue += 8;
        return false;
    });
    EXPECT_EQ(heard.downs[0], settings.device + " is opened anew: the device takes nothing");
}

TEST_F(UndeliveredTty, ADriverThatKeepsDiscardedBytesIsStillClosed) {
    report_queue();
    drops = false;
    auto line = start();
    line->write(Bytes(8, 0x55));
    queue = 8;
    line->reset("the request was not taken");
    ASSERT_EQ(heard.downs.size(), 1u);
    run_until([&] { return heard.ups == 2; });
}

TEST_F(UndeliveredTty, AResetLeavesTheTransceiverListening) {
    std::vector<int> rts;
    ops.answers[TIOCMBIS] = [&](void*) { return rts.push_back(1), 0; };
    ops.answers[TIOCMBIC] = [&](void*) { return rts.push_back(0), 0; };
    settings.rs485.mode = Rs485::Mode::rts;
    auto line = start();
    line->write(Bytes(8, 0x55));
    EXPECT_EQ(rts.back(), 1);
    line->reset("the request was not taken");
    EXPECT_EQ(rts.back(), 0);
}

TEST(CallInterrupter, EndsACallThatSleepsInTheKernel) {
    int ends[2];
    ASSERT_EQ(::pipe2(ends, O_CLOEXEC), 0);
    char byte = 0;
    ssize_t result = 0;
    {
        const CallInterrupter interrupter(1ms);
        result = ::read(ends[0], &byte, 1);
    }
    EXPECT_EQ(result, -1);
    EXPECT_EQ(errno, EINTR);
    ::close(ends[0]);
    ::close(ends[1]);
}

}  // namespace
}  // namespace panelgate::line::undelivered_tty_test
