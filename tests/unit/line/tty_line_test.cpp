#include "panelgate/line/tty_line.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "line_events.hpp"
#include "panelgate/line/pty.hpp"
#include "panelgate/rt/asio_clock.hpp"
#include "support/temp_dir.hpp"
#include "tty_trouble.hpp"

namespace panelgate::line::tty_line_test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class TtyLineTest : public testing::Test {
  protected:
    TtyLineTest() {
        settings.device = dir / "tty";
        settings.serial = {38400, 8, Parity::none, 1};
        settings.reopen_min = 1ms;
        settings.reopen_max = 4ms;
    }

    void plug(const Pty& pty) { std::filesystem::create_symlink(pty.path(), settings.device); }
    void unplug() { std::filesystem::remove(settings.device); }
    std::unique_ptr<Line> start(Heard& events) {
        auto line = make_tty_line(io.get_executor(), clock, settings);
        line->start(events);
        return line;
    }
    /// Runs the loop until `so()` is true; ctest limits the time.
    void run_until(const std::function<bool()>& so) {
        while (!so()) io.run_one();
    }
    static Bytes read_master(const Pty& pty, std::size_t count, int patience_ms = 5000) {
        Bytes got;
        while (got.size() < count) {
            pollfd p{pty.master(), POLLIN, 0};
            if (::poll(&p, 1, patience_ms) <= 0) break;
            std::uint8_t buffer[512];
            const ssize_t n = ::read(pty.master(), buffer, sizeof buffer);
            if (n > 0) got.insert(got.end(), buffer, buffer + n);
        }
        return got;
    }
    /// The other end writes; returns what the line has heard.
    Bytes hear(const Pty& pty, const Bytes& bytes) {
        EXPECT_EQ(::write(pty.master(), bytes.data(), bytes.size()), std::ssize(bytes));
        run_until([&] { return heard.bytes.size() >= bytes.size(); });
        return heard.bytes;
    }

    boost::asio::io_context io{1};
    rt::AsioClock clock{io.get_executor()};
    const test::TempDir folder;
    const std::filesystem::path& dir = folder.path();
    Settings settings;
    Heard heard;
};

TEST_F(TtyLineTest, PassesEveryByteValueBothWaysAtAnyIntegerRate) {
    const Pty pty;
    plug(pty);
    settings.serial.baud = 250001;
    const auto line = start(heard);
    ASSERT_EQ(heard.ups, 1);
    Bytes all;
    for (int i = 0; i < 256; ++i) all.push_back(static_cast<std::uint8_t>(i));
    line->write(all);
    EXPECT_EQ(read_master(pty, all.size()), all);
    EXPECT_EQ(hear(pty, all), all);
}

/// Access modes with which this process has opened a device.
std::vector<int> access_modes(const std::string& device) {
    std::vector<int> modes;
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
        std::error_code gone;
        if (std::filesystem::read_symlink(entry.path(), gone) != device) continue;
        const int fd = std::stoi(entry.path().filename());
        modes.push_back(::fcntl(fd, F_GETFL) & O_ACCMODE);
    }
    return modes;
}

TEST_F(TtyLineTest, ADeviceThatIsListenedToIsOpenedForReadingOnlyAndNothingLeaves) {
    const Pty pty;
    const auto before = access_modes(pty.path());  // the pty's own descriptor
    settings.device = pty.path();
    settings.listen_only = true;
    const auto line = start(heard);
    ASSERT_EQ(heard.ups, 1);
    const auto modes = access_modes(pty.path());
    ASSERT_EQ(modes.size(), before.size() + 1);
    EXPECT_EQ(std::count(modes.begin(), modes.end(), O_RDONLY), 1);
    const Bytes frame{0x1F, 0x03, 0x00, 0x64};
    line->write(frame);
    EXPECT_THAT(read_master(pty, 1, 20), IsEmpty());
    EXPECT_EQ(line->counters().bytes_sent, 0u);
    EXPECT_EQ(hear(pty, frame), frame);
    EXPECT_THAT(heard.downs, IsEmpty());
}

TEST_F(TtyLineTest, P7OpensADeviceThatAppearsLaterAndReportsOnceWhatIsMissing) {
    const auto line = start(heard);
    for (int i = 0; i < 3; ++i) io.run_one();  // further attempts report nothing new
    EXPECT_THAT(heard.downs,
                ElementsAre("cannot open " + settings.device + ": No such file or directory"));
    const Pty pty;
    plug(pty);
    run_until([&] { return heard.ups == 1; });
}

TEST_F(TtyLineTest, P7OpensADeviceWhenItIsPluggedInNotAtTheEndOfAPause) {
    settings.reopen_min = settings.reopen_max = 1h;
    const auto line = start(heard);
    for (int round = 1; round <= 3; ++round) {
        const Pty pty;
        plug(pty);
        run_until([&] { return heard.ups == round; });
        unplug();
    }
    EXPECT_EQ(heard.ups, 3);
}

TEST_F(TtyLineTest, P7FindsADeviceWhoseFolderComesWithIt) {
    settings.reopen_min = settings.reopen_max = 1h;
    const std::filesystem::path deep = dir / "by-id" / "deep";
    settings.device = deep / "usb-adapter";
    const auto line = start(heard);
    // The folder is watched as it comes: each step is a change that leads to an attempt.
    std::filesystem::create_directory(dir / "by-id");
    while (io.poll_one() > 0) {
    }
    std::filesystem::create_directory(deep);
    const Pty pty;
    plug(pty);
    run_until([&] { return heard.ups == 1; });
}

TEST_F(TtyLineTest, P7NoticesAnUnpluggedDeviceAndOpensItsSuccessor) {
    std::optional<Pty> pty(std::in_place);
    plug(*pty);
    const auto line = start(heard);
    ASSERT_EQ(heard.ups, 1);
    unplug();
    pty.reset();
    run_until([&] { return heard.downs.size() == 1; });
    const Pty successor;
    plug(successor);
    run_until([&] { return heard.ups == 2; });
    EXPECT_EQ(line->counters().reopens, 1u);
    line->write(Bytes{1, 2, 3});
    EXPECT_EQ(read_master(successor, 3), (Bytes{1, 2, 3}));
}

TEST_F(TtyLineTest, P7AWriteToAnUnpluggedDeviceTakesTheLineDown) {
    std::optional<Pty> pty(std::in_place);
    plug(*pty);
    const auto line = start(heard);
    unplug();
    pty.reset();
    line->write(Bytes{1, 2, 3});
    EXPECT_EQ(heard.downs.size(), 1u);
}

TEST_F(TtyLineTest, RefusesAFileThatIsNoSerialDevice) {
    settings.device = "/dev/null";
    const auto line = start(heard);
    EXPECT_THAT(heard.downs, ElementsAre(HasSubstr("not a serial device")));
}

TEST_F(TtyLineTest, ASecondUserIsTurnedAway) {
    const Pty pty;
    plug(pty);
    settings.owner = "line 'press'";
    auto first = start(heard);
    Heard other;
    const auto second = start(other);
    EXPECT_THAT(other.downs,
                ElementsAre("cannot open " + settings.device +
                            ": line 'press' of this gateway holds it, as " + settings.device));
    first.reset();
    run_until([&] { return other.ups == 1; });
}

TEST(TtyTrouble, ARefusedOpeningNamesTheGroupAndTheFlagForDocker) {
    const test::TempDir folder;
    const std::string device = folder.path() / "tty";
    std::ofstream(device) << "";
    ASSERT_EQ(::chmod(device.c_str(), 0640), 0);
    const std::string gid = std::to_string(getegid());
    const std::string user = "this is uid " + std::to_string(geteuid()) + " gid " + gid;
    EXPECT_THAT(explain_open_error(device, EACCES),
                AllOf(HasSubstr("Permission denied: it belongs to group "),
                      HasSubstr("with mode 640, " + user), HasSubstr("--group-add " + gid)));
    EXPECT_EQ(explain_open_error(device, ENOENT), "No such file or directory");
}

TEST(TtyTrouble, ACallThatSleepsInTheKernelIsInterrupted) {
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
}  // namespace panelgate::line::tty_line_test
