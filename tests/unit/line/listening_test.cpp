#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "line_events.hpp"
#include "panelgate/line/pty.hpp"
#include "panelgate/line/tcp_line.hpp"
#include "panelgate/line/tty_line.hpp"
#include "panelgate/rt/asio_clock.hpp"

namespace panelgate::line::listening_test {
namespace {

class ListeningTest : public testing::Test {
  protected:
    ListeningTest() {
        settings.serial = {38400, 8, Parity::none, 1};
        settings.listen_only = true;
    }
    void run_until(const std::function<bool()>& so) {
        while (!so()) io.run_one();
    }
    static bool has_input(int fd) {
        pollfd p{fd, POLLIN, 0};
        return ::poll(&p, 1, 20) > 0;
    }

    boost::asio::io_context io{1};
    rt::AsioClock clock{io.get_executor()};
    Settings settings;
    Heard heard;
    const Bytes frame{0x1F, 0x03, 0x00, 0x64};
};

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

TEST_F(ListeningTest, ADeviceIsOpenedForReadingOnlyAndNothingLeaves) {
    const Pty pty;
    const auto before = access_modes(pty.path());  // the pty's own descriptor
    settings.device = pty.path();
    auto line = make_tty_line(io.get_executor(), clock, settings);
    line->start(heard);
    ASSERT_EQ(heard.ups, 1);
    auto modes = access_modes(pty.path());
    ASSERT_EQ(modes.size(), before.size() + 1);
    EXPECT_EQ(std::count(modes.begin(), modes.end(), O_RDONLY), 1);
    line->write(frame);
    EXPECT_FALSE(has_input(pty.master()));
    EXPECT_EQ(line->counters().bytes_sent, 0u);
    ASSERT_EQ(::write(pty.master(), frame.data(), frame.size()), 4);
    run_until([&] { return heard.bytes.size() >= frame.size(); });
    EXPECT_EQ(heard.bytes, frame);
    EXPECT_TRUE(heard.downs.empty());
}

TEST_F(ListeningTest, AConnectionIsOnlyRead) {
    using boost::asio::ip::tcp;
    tcp::acceptor acceptor(io, tcp::endpoint(boost::asio::ip::address_v4::loopback(), 0));
    settings.device = "tcp://127.0.0.1:" + std::to_string(acceptor.local_endpoint().port());
    auto line = make_tcp_line(io.get_executor(), clock, settings);
    line->start(heard);
    tcp::socket server = acceptor.accept();
    run_until([&] { return heard.ups == 1; });
    line->write(frame);
    EXPECT_FALSE(has_input(server.native_handle()));
    EXPECT_EQ(line->counters().bytes_sent, 0u);
    ASSERT_EQ(::send(server.native_handle(), frame.data(), frame.size(), 0), 4);
    run_until([&] { return heard.bytes.size() >= frame.size(); });
    EXPECT_EQ(heard.bytes, frame);
    line->stop();
}

}  // namespace
}  // namespace panelgate::line::listening_test
