#include "panelgate/config/real_files.hpp"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

namespace panelgate::config {

namespace fs = std::filesystem;

std::optional<std::string> RealFiles::read(const std::string& path) const {
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
    std::error_code error;
    const fs::perms rights = fs::status(path, error).permissions();
    return !error && (rights & fs::perms::others_read) != fs::perms::none;
}

}  // namespace panelgate::config
