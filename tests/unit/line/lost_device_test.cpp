// P7: every sign of a lost device.
#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <cerrno>
#include <cstring>
#include <string>
#include <vector>

#include "failing_line.hpp"
#include "line_events.hpp"
#include "panelgate/line/pty.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::line::lost_device_test {
namespace {

class LostDevice : public testing::TestWithParam<int> {
  protected:
    boost::asio::io_context io{1};
    test::ManualClock clock;
    Settings settings{"/dev/ttyUSB0", {}, {}, 1ms, 1ms};
    Pty pty;
    Heard heard;
    FailingLine line{io.get_executor(), clock, settings, pty};
};

TEST_P(LostDevice, P7IsNoticedByReadingAndOpenedAgain) {
    line.start(heard);
    line.poll_input();  // EAGAIN: nothing there
    EXPECT_TRUE(heard.downs.empty());
    line.read_error = GetParam();
    line.poll_input();
    ASSERT_EQ(heard.downs.size(), 1u);
    EXPECT_EQ(heard.downs[0], std::string("/dev/ttyUSB0 is gone: ") + std::strerror(GetParam()));
    line.read_error = EAGAIN;
    ASSERT_TRUE(test::run_until(io, clock, [&] { return heard.ups == 2; }));
    EXPECT_EQ(line.counters().reopens, 1u);
    EXPECT_TRUE(heard.bytes.empty());
}

TEST_P(LostDevice, P7IsNoticedByWritingAndReportedOnce) {
    line.start(heard);
    line.write_error = GetParam();
    line.write(Bytes{1, 2, 3});
    line.write(Bytes{4, 5, 6});
    EXPECT_EQ(heard.downs.size(), 1u);
}

INSTANTIATE_TEST_SUITE_P(EverySign, LostDevice,
                         testing::Values(EIO, ENODEV, ENXIO, EBADF, EPIPE, ENOTCONN));

TEST_F(LostDevice, P7TheEndOfFileOfAHangUpIsNoticed) {
    line.start(heard);
    line.read_error = 0;
    line.poll_input();
    ASSERT_EQ(heard.downs.size(), 1u);
    EXPECT_EQ(heard.downs[0], "/dev/ttyUSB0 is gone: hang-up");
}

TEST_F(LostDevice, AnInterruptedCallIsNoLoss) {
    line.start(heard);
    line.read_error = EINTR;
    line.poll_input();
    EXPECT_TRUE(heard.downs.empty());
}

}  // namespace
}  // namespace panelgate::line::lost_device_test
