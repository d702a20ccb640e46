#include "descriptor_line.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <cstring>
#include <utility>

namespace panelgate::line::readiness_test {
namespace {

class ReadinessTest : public testing::Test {
  protected:
    ReadinessTest() {
        std::array<int, 2> ends{};
        EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends.data()), 0);
        near = ends[0];
        far = ends[1];
        EXPECT_EQ(readiness.watch(near), "");
    }
    ~ReadinessTest() override {
        readiness.forget();
        ::close(near);
        if (far >= 0) ::close(far);
    }
    void say(const char* bytes) { EXPECT_GT(::write(far, bytes, std::strlen(bytes)), 0); }
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

TEST_F(ReadinessTest, ReportsInput) {
    EXPECT_EQ(turn(), 0);
    say("a");
    EXPECT_EQ(turn(), 1);
    say("b");
    EXPECT_EQ(turn(), 1);
}

TEST_F(ReadinessTest, DeferredInputCausesNoWakeUp) {
    readiness.want_input(false);
    turn();
    for (int i = 0; i < 5; ++i) {
        say("a");
        EXPECT_EQ(turn(), 0);
    }
}

TEST_F(ReadinessTest, DeferredInputIsReportedWhenWantedAgain) {
    readiness.want_input(false);
    say("a");
    turn();
    readiness.want_input(true);
    EXPECT_EQ(turn(), 1);
}

TEST_F(ReadinessTest, DeferredInputThatWasReadIsNotReported) {
    readiness.want_input(false);
    say("a");
    turn();
    take_all();
    readiness.want_input(true);
    EXPECT_EQ(turn(), 0);
}

TEST_F(ReadinessTest, LossOfTheDeviceIsReportedWhileInputIsDeferred) {
    readiness.want_input(false);
    turn();
    ::close(std::exchange(far, -1));
    EXPECT_GE(turn(), 1);
}

TEST_F(ReadinessTest, ReportsWritableWhenWanted) {
    EXPECT_EQ(turn(), 0);
    readiness.want_output(true);
    EXPECT_EQ(turn(), 1);
    EXPECT_EQ(turn(), 0) << "it was taken back";
}

TEST_F(ReadinessTest, ForgetsAndTakesAnother) {
    readiness.forget();
    say("a");
    EXPECT_EQ(turn(), 0);
    EXPECT_EQ(readiness.watch(near), "");
    EXPECT_EQ(turn(), 1);
}

}  // namespace
}  // namespace panelgate::line::readiness_test
