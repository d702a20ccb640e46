#include "descriptor_line.hpp"

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/io_context.hpp>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <utility>

#include "line_events.hpp"
#include "panelgate/line/pty.hpp"
#include "panelgate/rt/clock.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::line::descriptor_line_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr TimePoint kStart{1h};

TEST(InputBudget, TakesABurstAndThenTheRate) {
    InputBudget budget(1000);
    double taken = 0;
    for (TimePoint now = kStart; now < kStart + 100s; now += 1ms) {
        for (; budget.allows(now); taken += 100) budget.spend(now, 100);
    }
    EXPECT_NEAR(taken, 100 * 1000, 1000 + 2 * 100);
}

TEST(InputBudget, ReportsWhenItAllowsMore) {
    InputBudget budget(1000);
    while (budget.allows(kStart)) budget.spend(kStart, 100);
    EXPECT_GT(budget.next(), kStart);
    EXPECT_LE(budget.next(), kStart + InputBudget::kBurst);
    EXPECT_TRUE(budget.allows(budget.next()));
}

TEST(InputBudget, InputWithinTheRateIsNeverPausedAndRepliesAreNoFlood) {
    for (const bool replies : {false, true}) {
        InputBudget budget(1000);
        for (TimePoint now = kStart; now < kStart + 10s; now += replies ? 1ms : 100ms) {
            if (replies) budget.on_sent();
            ASSERT_TRUE(budget.allows(now)) << replies;
            budget.spend(now, replies ? 500 : 100);
        }
    }
}

/// One end of a connection, watched.
struct Watched {
    Watched() {
        std::array<int, 2> ends{};
        EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends.data()), 0);
        near = ends[0];
        far = ends[1];
        EXPECT_EQ(readiness.watch(near), "");
    }
    ~Watched() {
        readiness.forget();
        ::close(near);
        if (far >= 0) ::close(far);
    }
    Watched(const Watched&) = delete;
    Watched& operator=(const Watched&) = delete;

    void say() { EXPECT_EQ(::write(far, "a", 1), 1); }
    void take_all() {
        std::array<char, 64> room;
        while (::read(near, room.data(), room.size()) > 0) {
        }
    }
    /// Runs the ready handlers of the loop; returns the number of notifications.
    int turn() {
        said = 0;
        io.restart();
        io.poll();
        return said;
    }

    int near = -1;
    int far = -1;
    boost::asio::io_context io{1};
    int said = 0;
    Readiness readiness{io.get_executor(), [this] {
                            ++said;
                            take_all();
                            readiness.want_output(false);
                        }};
};

TEST(Readiness, ReportsInput) {
    Watched end;
    EXPECT_EQ(end.turn(), 0);
    for (int i = 0; i < 2; ++i) {
        end.say();
        EXPECT_EQ(end.turn(), 1);
    }
}

TEST(Readiness, DeferredInputCausesNoWakeUp) {
    Watched end;
    end.readiness.want_input(false);
    end.turn();
    for (int i = 0; i < 5; ++i) {
        end.say();
        EXPECT_EQ(end.turn(), 0);
    }
}

TEST(Readiness, DeferredInputIsReportedWhenWantedAgainUnlessItWasRead) {
    for (const bool was_read : {false, true}) {
        Watched end;
        end.readiness.want_input(false);
        end.say();
        end.turn();
        if (was_read) end.take_all();
        end.readiness.want_input(true);
        EXPECT_EQ(end.turn(), was_read ? 0 : 1);
    }
}

TEST(Readiness, LossOfTheDeviceIsReportedWhileInputIsDeferred) {
    Watched end;
    end.readiness.want_input(false);
    end.turn();
    ::close(std::exchange(end.far, -1));
    EXPECT_GE(end.turn(), 1);
}

TEST(Readiness, ReportsWritableWhenWanted) {
    Watched end;
    EXPECT_EQ(end.turn(), 0);
    end.readiness.want_output(true);
    EXPECT_EQ(end.turn(), 1);
    EXPECT_EQ(end.turn(), 0) << "it was taken back";
}

TEST(Readiness, ForgetsAndTakesAnother) {
    Watched end;
    end.readiness.forget();
    end.say();
    EXPECT_EQ(end.turn(), 0);
    EXPECT_EQ(end.readiness.watch(end.near), "");
    EXPECT_EQ(end.turn(), 1);
}

/// Opens at once; reading and writing end as a test sets.
class FailingLine final : public DescriptorLine {
  public:
    FailingLine(const boost::asio::any_io_executor& executor, rt::Clock& clock,
                const Settings& settings, const Pty& pty)
        : DescriptorLine(executor, clock, settings), pty_(pty) {}
    ~FailingLine() override { stop(); }
    /// The device reports a hang-up.
    void lose() { lost("hang-up"); }
    /// The device delivers a byte.
    void bring() {
        bytes_ = 1;
        poll_input();
    }

    int read_error = EAGAIN;  ///< 0: end of file
    int write_error = 0;
    bool closed_for_good = false;  ///< the last closing discarded unsent bytes

  private:
    void begin_open() override {
        adopt(::dup(pty_.master()));
        opened();
    }
    void close_device(bool discard) override {
        closed_for_good = discard;
        DescriptorLine::close_device(discard);
    }
    ssize_t get(std::span<std::uint8_t> room) override {
        if (bytes_ > 0) {
            --bytes_;
            room[0] = 0x55;
            return 1;
        }
        errno = read_error;
        return read_error == 0 ? 0 : -1;
    }
    ssize_t put(ByteView bytes) override {
        errno = write_error;
        return write_error == 0 ? static_cast<ssize_t>(bytes.size()) : -1;
    }

    const Pty& pty_;
    int bytes_ = 0;
};

/// A line that has been opened, in virtual time.
struct Opened {
    explicit Opened(Duration longest_pause = 75ms)
        : settings{"/dev/ttyUSB0", {}, {}, 10ms, longest_pause} {
        line.start(heard);
    }
    /// Time from down to up.
    Duration pause() {
        const int ups = heard.ups;
        const TimePoint begin = clock.now();
        EXPECT_TRUE(test::run_until(io, clock, [&] { return heard.ups != ups; }));
        return clock.now() - begin;
    }
    Duration pause_after_reset() {
        line.reset("not taken");
        return pause();
    }

    boost::asio::io_context io{1};
    test::ManualClock clock;
    Settings settings;
    Pty pty;
    Heard heard;
    FailingLine line{io.get_executor(), clock, settings, pty};
};

TEST(LostDevice, P7EverySignIsNoticedByReadingAndTheDeviceIsOpenedAgain) {
    for (const int sign : {0, EIO, ENODEV, ENXIO, EBADF, EPIPE, ENOTCONN}) {
        Opened it;
        for (const int no_loss : {EAGAIN, EINTR}) {
            it.line.read_error = no_loss;
            it.line.poll_input();
            EXPECT_THAT(it.heard.downs, IsEmpty());
        }
        it.line.read_error = sign;
        it.line.poll_input();
        const std::string why = sign == 0 ? "hang-up" : std::strerror(sign);
        ASSERT_THAT(it.heard.downs, ElementsAre("/dev/ttyUSB0 is gone: " + why));
        it.line.read_error = EAGAIN;
        it.pause();
        EXPECT_EQ(it.heard.ups, 2);
        EXPECT_EQ(it.line.counters().reopens, 1u);
        EXPECT_THAT(it.heard.bytes, IsEmpty());
    }
}

TEST(LostDevice, P7EverySignIsNoticedByWritingAndReportedOnce) {
    for (const int sign : {EIO, ENODEV, ENXIO, EBADF, EPIPE, ENOTCONN}) {
        Opened it;
        it.line.write_error = sign;
        it.line.write(Bytes{1, 2, 3});
        it.line.write(Bytes{4, 5, 6});
        EXPECT_EQ(it.heard.downs.size(), 1u) << std::strerror(sign);
    }
}

TEST(Reopening, P7WaitsLongerAfterEachResetThatFollowsAnOpeningWithoutAByte) {
    Opened it;
    for (const Duration expected : {10ms, 20ms, 40ms, 75ms, 75ms})
        EXPECT_EQ(it.pause_after_reset(), expected);
}

TEST(Reopening, StartsAnewWhenAByteHasCome) {
    Opened it(10s);
    for (int i = 0; i < 4; ++i) it.pause_after_reset();
    EXPECT_EQ(it.pause_after_reset(), 160ms);
    it.line.write(Bytes{1, 2, 3});
    it.line.bring();
    EXPECT_EQ(it.pause_after_reset(), Duration::zero()) << "at once";
    EXPECT_EQ(it.pause_after_reset(), 20ms) << "short pauses again";
}

TEST(Reopening, P7AServerThatGreetsAndHangsUpIsNotAskedInATightLoop) {
    Opened it;
    for (const Duration expected : {10ms, 20ms, 40ms, 75ms}) {
        it.line.bring();  // "port in use", before anything was asked
        it.line.lose();
        EXPECT_EQ(it.pause(), expected);
    }
    it.clock.advance(it.settings.reopen_max);
    it.line.bring();  // a line that is only listened to
    it.line.lose();
    EXPECT_LT(it.pause(), Duration(75ms));
}

TEST(Reopening, P7AServerThatAcceptsAndHangsUpIsNotAskedInATightLoop) {
    Opened it;
    for (const Duration expected : {10ms, 20ms, 40ms}) {
        it.line.lose();
        EXPECT_EQ(it.pause(), expected);
    }
}

TEST(Reopening, AResetReportsDeviceAndReasonAndDiscards) {
    Opened it;
    it.line.reset("it was not taken");
    EXPECT_TRUE(it.line.closed_for_good);
    it.line.reset("again");  // down already
    EXPECT_THAT(it.heard.downs, ElementsAre("/dev/ttyUSB0 is opened anew: it was not taken"));
}

TEST(Reopening, ALossDiscardsOnlyWhatShouldHaveLeft) {
    Opened it;
    it.line.write(Bytes{1, 2, 3});
    it.line.lose();
    EXPECT_FALSE(it.line.closed_for_good);
    it.pause();
    it.line.write_error = EAGAIN;
    it.line.write(Bytes{1, 2, 3});
    it.line.lose();
    EXPECT_TRUE(it.line.closed_for_good);
}

TEST(Reopening, P1AtMostOneFrameIsEverUnsent) {
    Opened it;
    it.line.write_error = EAGAIN;
    EXPECT_FALSE(it.line.undelivered());
    it.line.write(Bytes{1, 2, 3});
    EXPECT_THAT(it.heard.downs, IsEmpty());
    EXPECT_TRUE(it.line.undelivered());
    it.line.write(Bytes{4, 5, 6});
    EXPECT_THAT(it.heard.downs,
                ElementsAre("/dev/ttyUSB0 is opened anew: the device takes nothing"));
    EXPECT_TRUE(it.line.closed_for_good);
    EXPECT_FALSE(it.line.undelivered());
    EXPECT_EQ(it.line.counters().bytes_sent, 3u);
}

}  // namespace
}  // namespace panelgate::line::descriptor_line_test
