// When a line is reopened whose opening brought no byte.
#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <cerrno>
#include <string>

#include "failing_line.hpp"
#include "line_events.hpp"
#include "panelgate/line/pty.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::line::reopening_test {
namespace {

class Reopening : public testing::Test {
  protected:
    Reopening() { line.start(heard); }
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
    Settings settings{"/dev/ttyUSB0", {}, {}, 10ms, 80ms};
    Pty pty;
    Heard heard;
    FailingLine line{io.get_executor(), clock, settings, pty};
};

TEST_F(Reopening, P7WaitsLongerAfterEachResetThatFollowsAnOpeningWithoutAByte) {
    EXPECT_EQ(pause_after_reset(), settings.reopen_min);
    EXPECT_EQ(pause_after_reset(), 2 * settings.reopen_min);
    EXPECT_EQ(pause_after_reset(), 4 * settings.reopen_min);
    EXPECT_EQ(pause_after_reset(), settings.reopen_max);
    EXPECT_EQ(pause_after_reset(), settings.reopen_max);
}

TEST_F(Reopening, StartsAnewWhenAByteHasCome) {
    settings.reopen_max = 10s;
    FailingLine patient{io.get_executor(), clock, settings, pty};
    patient.start(heard);
    const auto pause_of_patient = [&] {
        patient.reset("not taken");
        return pause();
    };
    for (int i = 0; i < 4; ++i) pause_of_patient();
    EXPECT_EQ(pause_of_patient(), 16 * settings.reopen_min);
    patient.bring();
    EXPECT_EQ(pause_of_patient(), Duration::zero()) << "at once";
    EXPECT_EQ(pause_of_patient(), 2 * settings.reopen_min) << "short pauses again";
}

TEST_F(Reopening, P7AServerThatAcceptsAndHangsUpIsNotAskedInATightLoop) {
    Duration all{};
    for (int i = 0; i < 3; ++i) {
        line.lose();
        all += pause();
    }
    EXPECT_EQ(all, 7 * settings.reopen_min);
}

TEST_F(Reopening, AResetReportsDeviceAndReasonAndDiscards) {
    line.reset("the request was not taken");
    ASSERT_EQ(heard.downs.size(), 1u);
    EXPECT_EQ(heard.downs[0], "/dev/ttyUSB0 is opened anew: the request was not taken");
    EXPECT_TRUE(line.closed_for_good);
    line.reset("again");  // down already
    EXPECT_EQ(heard.downs.size(), 1u);
}

TEST_F(Reopening, ALossDiscardsOnlyWhatShouldHaveLeft) {
    line.write(Bytes{1, 2, 3});
    line.lose();
    EXPECT_FALSE(line.closed_for_good);
    pause();
    line.write_error = EAGAIN;
    line.write(Bytes{1, 2, 3});
    line.lose();
    EXPECT_TRUE(line.closed_for_good);
}

TEST_F(Reopening, P1AtMostOneFrameIsEverUnsent) {
    line.write_error = EAGAIN;
    EXPECT_FALSE(line.undelivered());
    line.write(Bytes{1, 2, 3});
    EXPECT_TRUE(heard.downs.empty());
    EXPECT_TRUE(line.undelivered());
    line.write(Bytes{4, 5, 6});
    ASSERT_EQ(heard.downs.size(), 1u);
    EXPECT_EQ(heard.downs[0], "/dev/ttyUSB0 is opened anew: the device takes nothing");
    EXPECT_TRUE(line.closed_for_good);
    EXPECT_FALSE(line.undelivered());
    EXPECT_EQ(line.counters().bytes_sent, 3u);
}

}  // namespace
}  // namespace panelgate::line::reopening_test
