#include "panelgate/config/real_files.hpp"

#include <fcntl.h>
#include <linux/magic.h>
#include <poll.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/timerfd.h>
#include <sys/vfs.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <system_error>
#include <utility>

namespace panelgate::config {

namespace fs = std::filesystem;

namespace {

/// True for a read-only file system in memory, as Kubernetes mounts secrets, at any path.
bool is_secret_mount(const std::string& path) {
    struct statfs system{};
    if (statfs(path.c_str(), &system) != 0) return false;
    const auto type = static_cast<unsigned>(system.f_type);
    const bool in_memory = type == TMPFS_MAGIC || type == RAMFS_MAGIC;
    return in_memory && (system.f_flags & ST_RDONLY) != 0;
}

/// Waits up to a second for the writer of a named pipe; other files need none. Otherwise EPIPE.
bool has_writer(int file) {
    constexpr int kWriterTimeout = 1000;  // ms
    struct stat status{};
    struct statfs system{};
    if (::fstat(file, &status) != 0 || ::fstatfs(file, &system) != 0) return false;
    if (!S_ISFIFO(status.st_mode) || system.f_type == PIPEFS_MAGIC) return true;
    pollfd written{file, POLLIN, 0};
    const int ready = ::poll(&written, 1, kWriterTimeout);
    if (ready == 0) errno = EPIPE;
    return ready > 0;
}

/// A timer that poll(2) finds readable when time is up.
class Patience {
  public:
    /// Zero: it never is.
    explicit Patience(Duration most) {
        itimerspec once{};
        once.it_value.tv_sec = std::chrono::ceil<std::chrono::seconds>(most).count();
        ::timerfd_settime(timer_, 0, &once, nullptr);
    }
    ~Patience() { ::close(timer_); }
    Patience(const Patience&) = delete;
    Patience& operator=(const Patience&) = delete;

    /// Waits until the file has more bytes, or its end; false, with ETIMEDOUT, when time is up.
    bool await_bytes(int file) const {
        std::array<pollfd, 2> either{pollfd{file, POLLIN, 0}, pollfd{timer_, POLLIN, 0}};
        ::poll(either.data(), either.size(), -1);
        if (either[1].revents == 0) return true;
        errno = ETIMEDOUT;
        return false;
    }

  private:
    int timer_ = ::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC);
};

/// Reads an open file, 16 MiB at most, which is in non-blocking mode.
std::optional<std::string> read_all(int file, Duration most) {
    constexpr std::size_t kMost = std::size_t{16} * 1024 * 1024;
    std::string text;
    std::array<char, 16384> piece{};
    const Patience patience(most);
    for (;;) {
        const ssize_t n = ::read(file, piece.data(), piece.size());
        if (n == 0) return text;
        if (n < 0 && errno == EINTR) continue;
        if (n < 0 && errno == EAGAIN && patience.await_bytes(file)) continue;
        if (n < 0) return std::nullopt;
        text.append(piece.data(), static_cast<std::size_t>(n));
        if (text.size() <= kMost) continue;
        errno = EFBIG;
        return std::nullopt;
    }
}

}  // namespace

std::string RealFiles::real_path(const std::string& path) const {
    std::error_code unknown;
    const fs::path real = fs::canonical(path, unknown);
    return unknown ? path : real.string();
}

bool RealFiles::is_special(const std::string& path) const {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

std::optional<std::string> RealFiles::read(const std::string& path) const {
    if (!is_special(path)) return read_any(path);
    errno = EINVAL;
    return std::nullopt;
}

std::optional<std::string> RealFiles::read_any(const std::string& path) {
    std::error_code error;
    if (fs::is_directory(path, error)) {
        errno = EISDIR;
        return std::nullopt;
    }
    // Opening a pipe without a writer would block, as would reading where its writer is idle.
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK);
    if (file < 0) return std::nullopt;
    const bool is_typed = path == "/dev/stdin";  // perhaps by somebody who thinks
    const Duration most = is_typed ? Duration::zero() : kReadPatience;
    auto text = has_writer(file) ? read_all(file, most) : std::nullopt;
    const int why = errno;
    ::close(file);
    errno = why;
    return text;
}

std::optional<std::vector<std::string>> RealFiles::list_yaml(const std::string& dir) const {
    std::error_code error;
    fs::directory_iterator entries(dir, error);
    if (error) return std::nullopt;
    std::vector<std::string> paths;
    for (const fs::directory_entry& entry : entries) {
        if (entry.path().extension() == ".yaml") paths.push_back(entry.path().string());
    }
    std::sort(paths.begin(), paths.end());
    return paths;
}

bool RealFiles::is_readable_by_all(const std::string& path) const {
    if (is_secret_mount(path)) return false;
    std::error_code error;
    const fs::perms rights = fs::status(path, error).permissions();
    return !error && (rights & fs::perms::others_read) != fs::perms::none;
}

std::string beside(const std::string& file, const std::string& typed) {
    const fs::path folder = fs::path(file).parent_path();
    const bool has_folder =
        !folder.empty() && !file.starts_with("/dev/") && !file.starts_with("/proc/");
    if (!has_folder || fs::path(typed).is_absolute()) return typed;
    return fs::absolute(folder / typed).lexically_normal().string();
}

std::vector<std::string> add_profiles(const std::string& dir, const Files& files,
                                      profile::Catalogue& catalogue, yaml::Problems& problems) {
    const auto paths = files.list_yaml(dir);
    if (!paths) return {"cannot list the directory " + dir};
    std::vector<std::string> unreadable;
    for (const std::string& path : *paths) {
        const auto text = files.read(path);
        if (!text) {
            unreadable.push_back("cannot read " + path);
            continue;
        }
        yaml::Problems own(path);
        auto profile =
            profile::load_profile(*text, std::filesystem::path(path).stem().string(), own);
        problems.take(own);
        if (profile) catalogue.add(std::move(*profile));
    }
    return unreadable;
}

}  // namespace panelgate::config
