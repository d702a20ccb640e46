#include "device_watch.hpp"

#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

namespace panelgate::line {

namespace asio = boost::asio;
using boost::system::error_code;

DeviceWatch::DeviceWatch(const asio::any_io_executor& executor, std::string device,
                         std::function<void()> changed)
    : inotify_(executor), device_(std::move(device)), changed_(std::move(changed)) {}

DeviceWatch::~DeviceWatch() { *alive_ = false; }

bool DeviceWatch::prepare() {
    if (inotify_.is_open()) return true;
    const int fd = ::inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
    if (fd < 0) return false;
    error_code error;
    inotify_.assign(fd, error);
    if (error) ::close(fd);
    return !error;
}

void DeviceWatch::look() {
    if (!prepare()) return;
    if (!*alive_) take_all();  // what stop() left behind
    constexpr std::uint32_t kNews = IN_CREATE | IN_MOVED_TO | IN_ATTRIB | IN_DELETE_SELF;
    std::filesystem::path folder = std::filesystem::path(device_).parent_path();
    int watch = -1;
    while ((watch = ::inotify_add_watch(inotify_.native_handle(), folder.c_str(),
                                        kNews | IN_ONLYDIR)) < 0) {
        if (folder == folder.parent_path()) return;
        folder = folder.parent_path();
    }
    remember(watch);
    if (*alive_) return;
    alive_ = std::make_shared<bool>(true);
    wait();
}

/// Folders that come and go have a new number each time.
void DeviceWatch::remember(int watch) {
    constexpr std::size_t kMost = 16;
    if (std::ranges::find(watched_, watch) != watched_.end()) return;
    watched_.push_back(watch);
    if (watched_.size() <= kMost) return;
    ::inotify_rm_watch(inotify_.native_handle(), watched_.front());
    watched_.erase(watched_.begin());
}

void DeviceWatch::stop() {
    *alive_ = false;
    if (!inotify_.is_open()) return;
    error_code ignored;
    inotify_.cancel(ignored);
    for (const int watch : std::exchange(watched_, {})) {
        ::inotify_rm_watch(inotify_.native_handle(), watch);
    }
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
