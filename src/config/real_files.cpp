#include "panelgate/config/real_files.hpp"

#include <linux/magic.h>
#include <sys/statvfs.h>
#include <sys/vfs.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

namespace panelgate::config {

namespace fs = std::filesystem;

namespace {

/// A read-only file system in memory: how Kubernetes mounts secrets, anywhere.
bool is_mounted_for_one(const std::string& path) {
    struct statfs system{};
    if (statfs(path.c_str(), &system) != 0) return false;
    const bool in_memory = system.f_type == TMPFS_MAGIC || system.f_type == RAMFS_MAGIC;
    return in_memory && (system.f_flags & ST_RDONLY) != 0;
}

}  // namespace

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
    constexpr std::uintmax_t kMost = 16 * 1024 * 1024;
    std::error_code error;
    if (fs::is_directory(path, error)) {
        errno = EISDIR;
        return std::nullopt;
    }
    errno = 0;
    std::ifstream in(path, std::ios::binary);
    if (!in) return std::nullopt;
    std::string text;
    for (std::istreambuf_iterator<char> at(in), end; at != end; ++at) {
        if (text.size() >= kMost) {
            errno = EFBIG;
            return std::nullopt;
        }
        text += *at;
    }
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
    if (is_mounted_for_one(path)) return false;
    std::error_code error;
    const fs::perms rights = fs::status(path, error).permissions();
    return !error && (rights & fs::perms::others_read) != fs::perms::none;
}

}  // namespace panelgate::config
