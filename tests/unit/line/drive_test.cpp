#include "panelgate/line/line.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "support/manual_clock.hpp"

namespace panelgate::line {
namespace {

struct Send {
    char what;
};
struct Other {};

/// Wants whatever a test puts in.
struct Machine {
    std::optional<std::variant<Send, Other>> poll_action() {
        if (wishes.empty()) return std::nullopt;
        const auto first = wishes.front();
        wishes.erase(wishes.begin());
        return first;
    }
    std::optional<TimePoint> next_deadline() const { return deadline; }
    std::optional<TimePoint> busy_until() const { return busy; }

    std::vector<std::variant<Send, Other>> wishes;
    std::optional<TimePoint> deadline;
    std::optional<TimePoint> busy;
};

/// A device with something in it, and everything that happens, a letter each.
class DriveTest : public testing::Test, public Line {
  protected:
    void start(Events&) override {}
    void stop() override {}
    void poll_input() override {
        story += 'p';
        if (const auto bytes = std::exchange(device, {}); !bytes.empty())
            drive.hear([&](TimePoint) { story += bytes; });
    }
    void write(ByteView) override {}
    void hold_input(bool hold) override { held = hold; }
    const Counters& counters() override { return counters_; }

    struct Host {
        void act(const Send& send) {
            test->story += send.what;
            if (send.what == 'f') test->drive.hear([&](TimePoint) { test->story += 'd'; });
        }
        void act(const Other&) { test->story += 'o'; }
        void on_deadline(TimePoint now) {
            test->story += '!';
            test->machine.deadline.reset();
            test->rang = now;
        }
        void settled(TimePoint) { test->story += '.'; }
        DriveTest* test;
    };

    test::ManualClock clock;
    Machine machine;
    Host host{this};
    std::string device;  ///< has come, and nobody has read it
    std::string story;
    bool held = false;  ///< input wakes nobody
    TimePoint rang;
    Drive<Machine, Host> drive{clock, *this, machine, host};

  private:
    Counters counters_;
};

TEST_F(DriveTest, ReadsWhatTheDeviceHoldsBeforeItHandsOnWhatIsAsked) {
    device = "xy";
    machine.wishes = {Send{'s'}};
    drive.tell([&](TimePoint) { story += 'v'; });
    EXPECT_EQ(story, "pxys.v.");
}

TEST_F(DriveTest, ReadsWhatTheDeviceHoldsBeforeItLooksAtTheClock) {
    machine.deadline = clock.now() + 5ms;
    drive.tell([](TimePoint) {});
    device = "xy";
    story.clear();
    clock.advance(5ms);
    EXPECT_EQ(story, "pxy.!.");
}

TEST_F(DriveTest, AVerbIsToldTheTimeBehindTheReading) {
    const TimePoint late = clock.now() + 7ms;
    machine.deadline = clock.now() + 5ms;
    drive.tell([](TimePoint) {});
    clock.pass(7ms);
    clock.jump();
    EXPECT_EQ(rang, late);
}

TEST_F(DriveTest, ActsOnAllThatIsWantedBehindEachVerb) {
    machine.wishes = {Send{'a'}, Other{}, Send{'b'}};
    drive.hear([&](TimePoint) { story += 'v'; });
    EXPECT_EQ(story, "vaob.");
}

TEST_F(DriveTest, AVerbFromInsideAnActionIsDrainedByTheOuterLoop) {
    machine.wishes = {Send{'f'}, Send{'g'}};
    drive.hear([&](TimePoint) { story += 'v'; });
    EXPECT_EQ(story, "vfdg.")
        << "the write failed, the line went down, the rest is still done once";
}

TEST_F(DriveTest, TheAlarmFollowsTheMachinesDeadline) {
    machine.deadline = clock.now() + 5ms;
    drive.hear([](TimePoint) {});
    EXPECT_EQ(clock.next(), machine.deadline);
    machine.deadline = clock.now() + 3ms;
    drive.hear([](TimePoint) {});
    EXPECT_EQ(clock.next(), machine.deadline);
    machine.deadline.reset();
    drive.hear([](TimePoint) {});
    EXPECT_EQ(clock.next(), std::nullopt);
}

TEST_F(DriveTest, RestsUntilTheNextVerb) {
    machine.deadline = clock.now() + 5ms;
    drive.hear([](TimePoint) {});
    drive.rest();
    EXPECT_EQ(clock.next(), std::nullopt);
    drive.hear([](TimePoint) {});
    EXPECT_EQ(clock.next(), machine.deadline);
}

TEST_F(DriveTest, InputThatChangesNothingWaitsForItsTimeAndIsReadThen) {
    machine.deadline = clock.now() + 50ms;
    machine.busy = clock.now() + 5ms;
    drive.hear([](TimePoint) {});
    EXPECT_TRUE(held);
    EXPECT_EQ(clock.next(), machine.busy);
    device = "xy";
    story.clear();
    clock.advance(5ms);
    EXPECT_EQ(story, "pxy.!.");
    EXPECT_FALSE(held) << "its time is over: every byte matters again";
}

TEST_F(DriveTest, HeldInputIsReadBeforeAnyVerb) {
    machine.busy = clock.now() + 5ms;
    drive.hear([](TimePoint) {});
    device = "xy";
    story.clear();
    drive.tell([&](TimePoint) { story += 'v'; });
    EXPECT_EQ(story, "pxy.v.");
}

TEST_F(DriveTest, WhoRestsHoldsNothingBack) {
    machine.busy = clock.now() + 5ms;
    drive.hear([](TimePoint) {});
    drive.rest();
    EXPECT_FALSE(held);
    EXPECT_EQ(clock.next(), std::nullopt);
}

}  // namespace
}  // namespace panelgate::line
