#include "panelgate/rt/process.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <thread>

namespace panelgate::rt::punctual_test {
namespace {

SchedAttr attributes() {
    SchedAttr found;
    EXPECT_EQ(::syscall(SYS_sched_getattr, 0, &found, sizeof found, 0), 0);
    return found;
}

/// Runs in a thread of its own, as the settings stay.
template <class Body>
void in_thread(Body body) {
    std::thread(body).join();
}

TEST(Punctual, TimersOfTheThreadRingWithoutSlack) {
    in_thread([] {
        EXPECT_TRUE(be_punctual({}).empty());
        EXPECT_EQ(::prctl(PR_GET_TIMERSLACK), 1);
    });
}

/// A kernel without it reports 0.
TEST(Punctual, AsksForShortSlicesAndKeepsItsNiceness) {
    in_thread([] {
        const int nice = attributes().nice;
        be_punctual({});
        const SchedAttr now = attributes();
        EXPECT_TRUE(now.runtime == 0 || now.runtime == 100'000) << now.runtime;
        EXPECT_EQ(now.nice, nice);
        EXPECT_EQ(now.policy, static_cast<unsigned>(SCHED_OTHER));
    });
}

}  // namespace
}  // namespace panelgate::rt::punctual_test
