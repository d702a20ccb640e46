#include "panelgate/rt/service_manager.hpp"

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "panelgate/rt/log.hpp"
#include "support/manual_clock.hpp"
#include "support/temp_dir.hpp"

namespace panelgate::rt::service_manager_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

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

TEST_F(ServiceManagerTest, ReportsReadyAndStatusChanges) {
    ServiceManager manager(clock, {.notify_socket = path});
    std::string status = "1 of 2 lines up";
    manager.ready([&] { return status; });
    EXPECT_THAT(socket.told(), ElementsAre("READY=1\nSTATUS=1 of 2 lines up"));
    clock.advance(1min);
    EXPECT_THAT(socket.told(), IsEmpty()) << "no news";
    status = "2 of 2\nlines up";
    clock.advance(ServiceManager::kLook);
    EXPECT_THAT(socket.told(), ElementsAre("STATUS=2 of 2 lines up"));
}

TEST_F(ServiceManagerTest, ReportsAReloadWithItsTimeAndItsEnd) {
    ServiceManager manager(clock, {.notify_socket = path});
    manager.ready([] { return "fine"; });
    manager.reloading();
    manager.ready();
    EXPECT_THAT(socket.told(),
                ElementsAre("READY=1\nSTATUS=fine", "RELOADING=1\nMONOTONIC_USEC=3600000000",
                            "READY=1\nSTATUS=fine"));
}

TEST_F(ServiceManagerTest, ReportsHowLongStoppingTakesAndNothingAfterwards) {
    ServiceManager manager(clock, {.notify_socket = path});
    manager.ready([] { return "fine"; });
    socket.told();
    manager.stopping(12s);
    EXPECT_THAT(socket.told(), ElementsAre("STOPPING=1\nSTATUS=answering what is in flight\n"
                                           "EXTEND_TIMEOUT_USEC=12000000"));
    clock.advance(1min);
    EXPECT_THAT(socket.told(), IsEmpty());
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
    const auto before = socket.told();
    EXPECT_THAT(before, testing::Each("WATCHDOG=1"));
    clock.advance(ServiceManager::kAgain);
    const auto after = socket.told();
    const auto first = std::ranges::find(after, "READY=1\nSTATUS=fine");
    ASSERT_NE(first, after.end());
    const auto then = std::find_if(first, after.end(), [](const std::string& text) {
        return text.starts_with("RELOADING=1\n");
    });
    EXPECT_NE(then, after.end());
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
}  // namespace panelgate::rt::service_manager_test
