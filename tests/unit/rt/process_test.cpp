#include "panelgate/rt/process.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <numeric>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "panelgate/rt/log.hpp"
#include "support/manual_clock.hpp"
#include "support/temp_dir.hpp"

namespace panelgate::rt::process_test {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(Descriptors, AreSharedInProportionWhenThereAreFewerThanAskedFor) {
    using Numbers = std::vector<std::size_t>;
    EXPECT_EQ(share_descriptors(1280, {1024, 256}), (Numbers{1024, 256}));
    EXPECT_EQ(share_descriptors(0, {}), Numbers{});
    EXPECT_EQ(share_descriptors(0, {0}), Numbers{0});
    EXPECT_EQ(share_descriptors(640, {1024, 256}), (Numbers{512, 128}));
    EXPECT_EQ(share_descriptors(952, {1024, 256}), (Numbers{761, 190}));
    EXPECT_EQ(share_descriptors(10, {100000, 1}), (Numbers{9, 1})) << "at least one";
    EXPECT_EQ(share_descriptors(0, {1024, 256}), (Numbers{1, 1}));
}

TEST(Descriptors, TheLimitIsRaisedAsFarAsItMayBe) {
    rlimit before{};
    ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
    const rlimit low{32, before.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &low), 0);
    EXPECT_EQ(raise_descriptor_limit(), before.rlim_max);
    rlimit now{};
    EXPECT_EQ(::getrlimit(RLIMIT_NOFILE, &now), 0);
    EXPECT_EQ(now.rlim_cur, before.rlim_max);
    ::setrlimit(RLIMIT_NOFILE, &before);
}

SchedAttr attributes() {
    SchedAttr found;
    EXPECT_EQ(::syscall(SYS_sched_getattr, 0, &found, sizeof found, 0), 0);
    return found;
}

/// In a thread of its own, as the settings stay. A kernel without short slices reports 0.
TEST(Punctual, TimersRingWithoutSlackAndSlicesAreShortAtTheSameNiceness) {
    std::thread([] {
        const int nice = attributes().nice;
        EXPECT_TRUE(be_punctual({}).empty());
        EXPECT_EQ(::prctl(PR_GET_TIMERSLACK), 1);
        const SchedAttr now = attributes();
        EXPECT_TRUE(now.runtime == 0 || now.runtime == 100'000) << now.runtime;
        EXPECT_EQ(now.nice, nice);
        EXPECT_EQ(now.policy, static_cast<unsigned>(SCHED_OTHER));
    }).join();
}

TEST(LoopLag, MeasuresHowLongTheLoopWasBlockedWhileItIsStarted) {
    test::ManualClock clock;
    LoopLag lag(clock);
    const auto samples = [&] {
        const auto& counts = lag.seconds().counts;
        return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
    };
    clock.advance(1s);
    lag.start();
    lag.stop();
    clock.advance(1s);
    EXPECT_EQ(samples(), 0u);
    lag.start();
    clock.advance(10 * LoopLag::kEvery);
    EXPECT_EQ(samples(), 10u);
    EXPECT_EQ(lag.seconds().counts[0], 10u);
    EXPECT_EQ(lag.seconds().sum, 0.0) << "it comes in time";
    clock.pass(LoopLag::kEvery + 130ms);
    clock.advance(LoopLag::kEvery);
    EXPECT_EQ(samples(), 12u);
    EXPECT_NEAR(lag.seconds().sum, 0.13, 1e-9);
}

TEST(Worker, WorksInAnotherThreadOneJobAfterTheOtherAndIsDoneInTheLoop) {
    boost::asio::io_context io(1);
    Worker worker(io.get_executor());
    std::thread::id worked;
    std::thread::id done;
    worker.run([&] { worked = std::this_thread::get_id(); },
               [&] { done = std::this_thread::get_id(); });
    std::vector<int> order;
    for (int i = 0; i < 5; ++i) worker.run([&order, i] { order.push_back(i); }, [] {});
    io.run();  // does not end before
    EXPECT_NE(worked, std::thread::id());
    EXPECT_NE(worked, std::this_thread::get_id());
    EXPECT_EQ(done, std::this_thread::get_id());
    EXPECT_EQ(order, (std::vector{0, 1, 2, 3, 4}));
}

TEST(Worker, ItsEndWaitsForTheJobThatRuns) {
    boost::asio::io_context io(1);
    std::promise<void> begun;
    std::promise<void> go_on;
    bool ended = false;
    std::jthread helper;
    {
        Worker worker(io.get_executor());
        const auto work = [&] {
            begun.set_value();
            go_on.get_future().wait();
            ended = true;
        };
        worker.run(work, [] {});
        begun.get_future().wait();
        helper = std::jthread([&] { go_on.set_value(); });
    }
    EXPECT_TRUE(ended);
    io.run();
}

/// systemd's end of the socket.
class NotifySocket {
  public:
    /// A path, or an abstract name after '@'.
    explicit NotifySocket(std::string name) : socket_(::socket(AF_UNIX, SOCK_DGRAM, 0)) {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        if (name[0] == '@') name[0] = '\0';
        name.copy(address.sun_path, sizeof(address.sun_path) - 1);
        const auto size = offsetof(sockaddr_un, sun_path) + name.size();
        if (::bind(socket_, reinterpret_cast<sockaddr*>(&address), static_cast<socklen_t>(size)) !=
            0)
            std::abort();
    }
    ~NotifySocket() { ::close(socket_); }
    NotifySocket(const NotifySocket&) = delete;
    NotifySocket& operator=(const NotifySocket&) = delete;

    /// Messages received since the last call.
    std::vector<std::string> told() const {
        std::vector<std::string> all;
        std::array<char, 4096> part{};
        for (;;) {
            const ssize_t got = ::recv(socket_, part.data(), part.size(), MSG_DONTWAIT);
            if (got < 0) return all;
            all.emplace_back(part.data(), static_cast<std::size_t>(got));
        }
    }

  private:
    int socket_;
};

class ServiceManagerTest : public testing::Test {
  protected:
    test::TempDir folder;
    std::string path = folder.path() / "notify";
    NotifySocket socket{path};
    test::ManualClock clock;
    LogTap log;
};

TEST_F(ServiceManagerTest, ReportsReadyStatusChangesAReloadAndItsEnd) {
    ServiceManager manager(clock, {.notify_socket = path});
    std::string status = "1 of 2 lines up";
    manager.ready([&] { return status; });
    EXPECT_THAT(socket.told(), ElementsAre("READY=1\nSTATUS=1 of 2 lines up"));
    clock.advance(1min);
    EXPECT_THAT(socket.told(), IsEmpty()) << "no news";
    status = "2 of 2\nlines up";
    clock.advance(ServiceManager::kLook);
    EXPECT_THAT(socket.told(), ElementsAre("STATUS=2 of 2 lines up"));
    clock.advance(1h - 1min - ServiceManager::kLook);
    manager.reloading();
    manager.ready();
    EXPECT_THAT(socket.told(), ElementsAre("RELOADING=1\nMONOTONIC_USEC=7200000000",
                                           "READY=1\nSTATUS=2 of 2 lines up"));
    manager.stopping(12s);
    EXPECT_THAT(socket.told(), ElementsAre("STOPPING=1\nSTATUS=answering what is in flight\n"
                                           "EXTEND_TIMEOUT_USEC=12000000"));
    clock.advance(1min);
    EXPECT_THAT(socket.told(), IsEmpty()) << "nothing afterwards";
}

TEST_F(ServiceManagerTest, TheWatchdogIsFedAtHalfOfItsTimeByTheLoopAlone) {
    const ServiceEnvironment asked{path, "2000000", std::to_string(::getpid())};
    ServiceManager manager(clock, asked);
    EXPECT_THAT(socket.told(), ElementsAre("WATCHDOG=1"));
    clock.advance(999ms);
    EXPECT_THAT(socket.told(), IsEmpty());
    clock.advance(1ms);
    EXPECT_THAT(socket.told(), ElementsAre("WATCHDOG=1"));
    clock.pass(1h);  // the loop hangs
    EXPECT_THAT(socket.told(), IsEmpty());
}

TEST_F(ServiceManagerTest, AnAbstractSocketIsOneToo) {
    const std::string name = "@panelgate-test-" + std::to_string(::getpid());
    const NotifySocket hidden(name);
    ServiceManager manager(clock, {.notify_socket = name});
    manager.ready([] { return "fine"; });
    EXPECT_THAT(hidden.told(), ElementsAre("READY=1\nSTATUS=fine"));
}

TEST_F(ServiceManagerTest, ALateReaderGetsEachStateChangeInOrderWithoutBlocking) {
    const ServiceEnvironment asked{path, "20000", ""};
    ServiceManager manager(clock, asked);
    clock.advance(1min);  // more than the socket keeps
    manager.ready([] { return "fine"; });
    manager.reloading();
    EXPECT_THAT(socket.told(), Each("WATCHDOG=1"));
    clock.advance(ServiceManager::kAgain);
    const auto after = socket.told();
    const auto first = std::ranges::find(after, "READY=1\nSTATUS=fine");
    ASSERT_NE(first, after.end());
    EXPECT_TRUE(std::any_of(first, after.end(), [](const std::string& text) {
        return text.starts_with("RELOADING=1\n");
    }));
}

TEST_F(ServiceManagerTest, WithoutASocketNothingIsTriedAndNoAlarmArmed) {
    ServiceManager manager(clock, {.notify_socket = {}, .watchdog_usec = "2000000"});
    manager.ready([] { return "fine"; });
    manager.reloading();
    manager.stopping(1s);
    EXPECT_EQ(clock.armed(), 0u);
    EXPECT_EQ(log.count(""), 0u);
}

TEST_F(ServiceManagerTest, AnUnusableSocketIsReportedAndNotFatal) {
    for (const std::string& name : {std::string("vsock:2:1234"), '/' + std::string(200, 'x')}) {
        ServiceManager manager(clock, {.notify_socket = name});
        manager.ready([] { return "fine"; });
    }
    EXPECT_EQ(log.count("warn service manager not notified socket="), 2u);
    ServiceManager manager(clock, {.notify_socket = folder.path() / "nobody"});
    manager.ready([] { return "fine"; });
    EXPECT_EQ(log.count("warn service manager not notified why=\"No such file"), 1u);
}

TEST(WatchdogInterval, IgnoresAnotherProcessAndInvalidNumbers) {
    const auto of = [](const char* usec, const char* pid) {
        return watchdog_interval({"/x", usec, pid}, 77);
    };
    EXPECT_EQ(of("30000000", "77"), 15s);
    EXPECT_EQ(of("30000000", ""), 15s);
    EXPECT_EQ(of("1", ""), 1us);
    for (const char* none : {"", "0", "-5", "5s", "99999999999999999999"})
        EXPECT_EQ(of(none, ""), std::nullopt) << none;
    for (const char* other : {"78", "x", "0"})
        EXPECT_EQ(of("30000000", other), std::nullopt) << other;
}

}  // namespace
}  // namespace panelgate::rt::process_test
