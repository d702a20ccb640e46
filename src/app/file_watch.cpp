#include "file_watch.hpp"

#include <sys/stat.h>

#include <utility>

namespace panelgate::app {

FileWatch::FileWatch(boost::asio::any_io_executor executor, rt::Clock& clock, std::string path,
                     std::function<void()> changed)
    : path_(std::move(path)),
      changed_(std::move(changed)),
      clock_(clock),
      alarm_(clock.make_alarm()),
      known_(stamp_of(path_)),
      seen_(known_),
      worker_(std::move(executor)) {
    later();
}

FileWatch::Stamp FileWatch::stamp_of(const std::string& path) {
    struct stat facts{};
    if (::stat(path.c_str(), &facts) != 0) return std::nullopt;
    const std::int64_t changed = facts.st_mtim.tv_sec * 1'000'000'000 + facts.st_mtim.tv_nsec;
    return std::tuple(std::uint64_t{facts.st_dev}, std::uint64_t{facts.st_ino},
                      std::int64_t{facts.st_size}, changed);
}

void FileWatch::later() {
    alarm_->arm(clock_.now() + kEvery, [this] { look(); });
}

void FileWatch::look() {
    auto stamp = std::make_shared<Stamp>();
    worker_.run([stamp, path = path_] { *stamp = stamp_of(path); },
                [this, stamp, alive = std::weak_ptr(alive_)] {
                    if (!alive.expired()) judge(*stamp);
                });
}

void FileWatch::judge(const Stamp& seen) {
    const bool rests = seen == std::exchange(seen_, seen);
    if (rests && seen && seen != known_) {
        known_ = seen;
        changed_();
    }
    later();
}

}  // namespace panelgate::app
