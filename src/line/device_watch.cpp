#include "device_watch.hpp"

#include <sys/inotify.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <utility>

namespace panelgate::line {

namespace asio = boost::asio;
using boost::system::error_code;

DeviceWatch::DeviceWatch(const asio::any_io_executor& executor, std::string device,
                         std::function<void()> changed)
    : inotify_(executor), device_(std::move(device)), changed_(std::move(changed)) {}

void DeviceWatch::look() {
    if (!inotify_.is_open()) {
        const int fd = ::inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
        if (fd < 0) return;
        error_code error;
        inotify_.assign(fd, error);
        if (error) {
            ::close(fd);
            return;
        }
        alive_ = std::make_shared<bool>(true);
        wait();
    }
    constexpr std::uint32_t kNews = IN_CREATE | IN_MOVED_TO | IN_ATTRIB | IN_DELETE_SELF;
    std::filesystem::path folder = std::filesystem::path(device_).parent_path();
    while (::inotify_add_watch(inotify_.native_handle(), folder.c_str(), kNews | IN_ONLYDIR) < 0) {
        if (folder == folder.parent_path()) return;
        folder = folder.parent_path();
    }
}

void DeviceWatch::stop() {
    *alive_ = false;
    error_code ignored;
    inotify_.close(ignored);
}

void DeviceWatch::wait() {
    inotify_.async_wait(asio::posix::stream_descriptor::wait_read,
                        [this, alive = alive_](error_code error) {
                            if (error || !*alive) return;
                            take_all();
                            changed_();
                            if (*alive) wait();
                        });
}

/// What changed does not matter: the device is tried.
void DeviceWatch::take_all() {
    std::array<char, 4096> events;
    while (::read(inotify_.native_handle(), events.data(), events.size()) > 0) {
    }
}

}  // namespace panelgate::line
