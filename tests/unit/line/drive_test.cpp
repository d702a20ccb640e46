#include "panelgate/line/line.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "support/manual_clock.hpp"

namespace panelgate::line::drive_test {
namespace {

struct Send {
    char what;
};
struct Other {};

/// Requests what a test sets.
struct Machine {
    std::optional<std::variant<Send, Other>> poll_action() {
        if (wishes.empty()) return std::nullopt;
        const auto first = wishes.front();
        wishes.erase(wishes.begin());
        return first;
    }
    std::optional<TimePoint> next_deadline() const { return deadline; }
    std::optional<TimePoint> busy_until() const { return busy; }
    bool is_waiting() const { return waiting; }

    std::vector<std::variant<Send, Other>> wishes;
    std::optional<TimePoint> deadline;
    std::optional<TimePoint> busy;
    bool waiting = false;
};

/// A device with pending input; records every event as a letter.
class DriveTest : public testing::Test, public Line {
  protected:
    void start(Events&) override {}
    void stop() override {}
    void poll_input() override {
        event_trace += 'p';
        if (const auto bytes = std::exchange(device, {}); !bytes.empty())
            drive.hear([&](TimePoint) { event_trace += bytes; });
    }
    void write(ByteView) override {}
    void defer_input(bool hold) override { held = hold; }
    const Counters& counters() override { return counters_; }
    /// An event without effect arms the alarm.
    void hear_nothing() {
        drive.hear([](TimePoint) {});
        event_trace.clear();
    }

    struct Host {
        void act(const Send& send) {
            test->event_trace += send.what;
            if (send.what == 'f') test->drive.hear([&](TimePoint) { test->event_trace += 'd'; });
        }
        void act(const Other&) { test->event_trace += 'o'; }
        void on_deadline(TimePoint now) {
            test->event_trace += '!';
            test->machine.deadline.reset();
            test->rang = now;
        }
        void settled(TimePoint) { test->event_trace += '.'; }
        DriveTest* test;
    };

    test::ManualClock clock;
    Machine machine;
    Host host{this};
    std::string device;  ///< received and not yet read
    std::string event_trace;
    bool held = false;  ///< input is deferred
    TimePoint rang;
    Drive<Machine, Host> drive{clock, *this, machine, host};

  private:
    Counters counters_;
};

TEST_F(DriveTest, ReadsPendingInputBeforeACall) {
    device = "xy";
    machine.wishes = {Send{'s'}};
    drive.tell([&](TimePoint) { event_trace += 'v'; });
    EXPECT_EQ(event_trace, "pxys.v.");
}

TEST_F(DriveTest, ReadsNoInputForWhatWaitsBehindARequestUntilSomethingIsDue) {
    const auto queue = [&] {
        event_trace.clear();
        drive.queue([&](TimePoint) { event_trace += 'v'; });
        return event_trace;
    };
    EXPECT_EQ(queue(), "pv.") << "it may be sent";
    machine.waiting = true;
    EXPECT_EQ(queue(), "pv.") << "no alarm would read it";
    machine.deadline = clock.now() + 5ms;
    hear_nothing();
    EXPECT_EQ(queue(), "v.");
    clock.pass(5ms);
    EXPECT_EQ(queue(), "pv.") << "what has come may answer in time";
}

TEST_F(DriveTest, ReadsPendingInputBeforeTheClock) {
    machine.deadline = clock.now() + 5ms;
    hear_nothing();
    device = "xy";
    clock.advance(5ms);
    EXPECT_EQ(event_trace, "pxy.!.");
}

TEST_F(DriveTest, ACallGetsTheTimeAfterReading) {
    const TimePoint late = clock.now() + 7ms;
    machine.deadline = clock.now() + 5ms;
    hear_nothing();
    clock.pass(7ms);
    clock.jump();
    EXPECT_EQ(rang, late);
}

TEST_F(DriveTest, ActsOnAllThatIsWantedBehindEachVerb) {
    machine.wishes = {Send{'a'}, Other{}, Send{'b'}};
    drive.hear([&](TimePoint) { event_trace += 'v'; });
    EXPECT_EQ(event_trace, "vaob.");
}

TEST_F(DriveTest, AVerbFromInsideAnActionIsDrainedByTheOuterLoop) {
    machine.wishes = {Send{'f'}, Send{'g'}};
    drive.hear([&](TimePoint) { event_trace += 'v'; });
    EXPECT_EQ(event_trace, "vfdg.")
        << "the write failed, the line went down, the rest is still done once";
}

TEST_F(DriveTest, TheAlarmFollowsTheMachinesDeadlineAndRestsUntilTheNextVerb) {
    for (const Duration from_now : {5ms, 3ms}) {
        machine.deadline = clock.now() + from_now;
        hear_nothing();
        EXPECT_EQ(clock.next(), machine.deadline);
        drive.rest();
        EXPECT_EQ(clock.next(), std::nullopt);
        hear_nothing();
        EXPECT_EQ(clock.next(), machine.deadline);
    }
    machine.deadline.reset();
    hear_nothing();
    EXPECT_EQ(clock.next(), std::nullopt);
}

TEST_F(DriveTest, InputThatChangesNothingWaitsForItsTimeAndIsReadThen) {
    machine.deadline = clock.now() + 50ms;
    machine.busy = clock.now() + 5ms;
    hear_nothing();
    EXPECT_TRUE(held);
    EXPECT_EQ(clock.next(), machine.busy);
    device = "xy";
    clock.advance(5ms);
    EXPECT_EQ(event_trace, "pxy.!.");
    EXPECT_FALSE(held) << "its time is over: every byte matters again";
}

TEST_F(DriveTest, DeferredInputIsReadBeforeAnyCallAndRestEndsDeferral) {
    machine.busy = clock.now() + 5ms;
    hear_nothing();
    device = "xy";
    drive.tell([&](TimePoint) { event_trace += 'v'; });
    EXPECT_EQ(event_trace, "pxy.v.");
    EXPECT_TRUE(held);
    drive.rest();
    EXPECT_FALSE(held);
    EXPECT_EQ(clock.next(), std::nullopt);
}

}  // namespace
}  // namespace panelgate::line::drive_test
