#include "panelgate/line/tty_line.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "line_events.hpp"
#include "panelgate/line/pty.hpp"
#include "panelgate/line/reopen.hpp"
#include "panelgate/rt/asio_clock.hpp"
#include "support/temp_dir.hpp"

namespace panelgate::line::tty_line_test {
namespace {

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
    /// Runs the loop until `so()` is true; ctest limits the time.
    void run_until(const std::function<bool()>& so) {
        while (!so()) io.run_one();
    }
    static Bytes read_master(const Pty& pty, std::size_t count) {
        Bytes got;
        while (got.size() < count) {
            pollfd p{pty.master(), POLLIN, 0};
            if (::poll(&p, 1, 5000) <= 0) break;
            std::uint8_t buffer[512];
            const ssize_t n = ::read(pty.master(), buffer, sizeof buffer);
            if (n > 0) got.insert(got.end(), buffer, buffer + n);
        }
        return got;
    }

    boost::asio::io_context io{1};
    rt::AsioClock clock{io.get_executor()};
    const test::TempDir folder;
    const std::filesystem::path& dir = folder.path();
    Settings settings;
    Heard heard;
};

TEST_F(TtyLineTest, PassesEveryByteValueBothWays) {
    Pty pty;
    plug(pty);
    auto line = make_tty_line(io.get_executor(), clock, settings);
    line->start(heard);
    ASSERT_EQ(heard.ups, 1);
    Bytes all;
    for (int i = 0; i < 256; ++i) all.push_back(static_cast<std::uint8_t>(i));
    line->write(all);
    EXPECT_EQ(read_master(pty, all.size()), all);
    ASSERT_EQ(::write(pty.master(), all.data(), all.size()), 256);
    run_until([&] { return heard.bytes.size() >= all.size(); });
    EXPECT_EQ(heard.bytes, all);
}

TEST_F(TtyLineTest, P7OpensADeviceThatAppearsLaterAndReportsOnceWhatIsMissing) {
    auto line = make_tty_line(io.get_executor(), clock, settings);
    line->start(heard);
    ASSERT_EQ(heard.downs.size(), 1u);
    EXPECT_EQ(heard.downs[0], "cannot open " + settings.device + ": No such file or directory");
    for (int i = 0; i < 3; ++i) io.run_one();  // further attempts report nothing new
    EXPECT_EQ(heard.downs.size(), 1u);
    Pty pty;
    plug(pty);
    run_until([&] { return heard.ups == 1; });
}

TEST_F(TtyLineTest, P7OpensADeviceWhenItIsPluggedInNotAtTheEndOfAPause) {
    settings.reopen_min = settings.reopen_max = 1h;
    auto line = make_tty_line(io.get_executor(), clock, settings);
    line->start(heard);
    for (int round = 1; round <= 3; ++round) {
        Pty pty;
        plug(pty);
        run_until([&] { return heard.ups == round; });
        unplug();
    }
    EXPECT_EQ(heard.ups, 3);
}

TEST_F(TtyLineTest, P7FindsADeviceWhoseFolderComesWithIt) {
    settings.reopen_min = settings.reopen_max = 1h;
    const std::filesystem::path folder = dir / "by-id" / "deep";
    settings.device = folder / "usb-adapter";
    auto line = make_tty_line(io.get_executor(), clock, settings);
    line->start(heard);
    // The folder is watched as it comes: each step is a change that leads to an attempt.
    std::filesystem::create_directory(dir / "by-id");
    while (io.poll_one() > 0) {
    }
    std::filesystem::create_directory(folder);
    Pty pty;
    plug(pty);
    run_until([&] { return heard.ups == 1; });
}

TEST_F(TtyLineTest, P7NoticesAnUnpluggedDeviceAndOpensItsSuccessor) {
    auto line = make_tty_line(io.get_executor(), clock, settings);
    {
        Pty pty;
        plug(pty);
        line->start(heard);
        ASSERT_EQ(heard.ups, 1);
        unplug();
    }
    run_until([&] { return heard.downs.size() == 1; });
    Pty successor;
    plug(successor);
    run_until([&] { return heard.ups == 2; });
    EXPECT_EQ(line->counters().reopens, 1u);
    line->write(Bytes{1, 2, 3});
    EXPECT_EQ(read_master(successor, 3), (Bytes{1, 2, 3}));
}

TEST_F(TtyLineTest, P7AWriteToAnUnpluggedDeviceTakesTheLineDown) {
    auto line = make_tty_line(io.get_executor(), clock, settings);
    std::optional<Pty> pty(std::in_place);
    plug(*pty);
    line->start(heard);
    unplug();
    pty.reset();
    line->write(Bytes{1, 2, 3});
    EXPECT_EQ(heard.downs.size(), 1u);
}

TEST_F(TtyLineTest, RefusesAFileThatIsNoSerialDevice) {
    settings.device = "/dev/null";
    auto line = make_tty_line(io.get_executor(), clock, settings);
    line->start(heard);
    ASSERT_EQ(heard.downs.size(), 1u);
    EXPECT_NE(heard.downs[0].find("not a serial device"), std::string::npos) << heard.downs[0];
}

TEST_F(TtyLineTest, ASecondUserIsTurnedAway) {
    Pty pty;
    plug(pty);
    auto first = make_tty_line(io.get_executor(), clock, settings);
    first->start(heard);
    Heard other;
    auto second = make_tty_line(io.get_executor(), clock, settings);
    second->start(other);
    ASSERT_EQ(other.downs.size(), 1u);
    const std::string process = "process " + std::to_string(getpid());
    EXPECT_EQ(other.downs[0], "cannot open " + settings.device + ": " + process + " holds it");
    first.reset();
    run_until([&] { return other.ups == 1; });
}

TEST_F(TtyLineTest, TakesAnyIntegerRate) {
    Pty pty;
    plug(pty);
    settings.serial.baud = 250001;
    auto line = make_tty_line(io.get_executor(), clock, settings);
    line->start(heard);
    EXPECT_EQ(heard.ups, 1);
}

TEST(Reopen, DoublesItsPausesUpToTheLimitAndStartsAnewAfterSuccess) {
    Reopen reopen(100ms, 350ms);
    EXPECT_EQ(reopen.next_pause(), 100ms);
    EXPECT_EQ(reopen.next_pause(), 200ms);
    EXPECT_EQ(reopen.next_pause(), 350ms);
    EXPECT_EQ(reopen.next_pause(), 350ms);
    reopen.succeeded();
    EXPECT_EQ(reopen.next_pause(), 100ms);
}

}  // namespace
}  // namespace panelgate::line::tty_line_test
