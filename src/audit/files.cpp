#include "panelgate/audit/files.hpp"

#include <fcntl.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "panelgate/base/text.hpp"

namespace panelgate::audit {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kDigits = 12;

}  // namespace

std::string rotated_name(const std::string& file, std::uint64_t first) {
    std::string digits = std::to_string(first);
    if (digits.size() < kDigits) digits.insert(0, kDigits - digits.size(), '0');
    return file + '.' + digits;
}

std::optional<std::uint64_t> number_in(const std::string& name, const std::string& file) {
    const std::string start = fs::path(file).filename().string() + '.';
    const std::string own = fs::path(name).filename().string();
    if (!own.starts_with(start)) return std::nullopt;
    const auto number = to_number<std::uint64_t>(std::string_view(own).substr(start.size()));
    return number && *number > 0 ? number : std::nullopt;
}

/// Their numbers have leading zeros: the order of names is that of records.
std::vector<std::string> rotated_files(const std::string& file) {
    const fs::path path(file);
    const std::string begin = path.filename().string() + '.';
    std::vector<std::string> found;
    std::error_code error;
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    for (const auto& entry : fs::directory_iterator(folder, error)) {
        const std::string name = entry.path().filename().string();
        if (name.size() < begin.size() + kDigits || !name.starts_with(begin)) continue;
        const std::string_view digits = std::string_view(name).substr(begin.size(), kDigits);
        if (std::ranges::all_of(digits, [](char c) { return c >= '0' && c <= '9'; }))
            found.push_back(entry.path().string());
    }
    std::ranges::sort(found);
    return found;
}

namespace {

/// Takes the lines that `text` has from its beginning out of it. False: no more is wanted.
bool take_lines(std::string& text,
                const std::function<bool(std::string_view line, bool whole)>& take) {
    std::size_t at = 0;
    for (std::size_t end = text.find('\n'); end != text.npos; end = text.find('\n', at)) {
        if (!take(std::string_view(text).substr(at, end - at), true)) return false;
        at = end + 1;
    }
    text.erase(0, at);
    if (text.size() < kLongestLine) return true;
    const bool more = take(text, true);
    text.clear();
    return more;
}

}  // namespace

std::string read_lines(const std::string& file,
                       const std::function<bool(std::string_view line, bool whole)>& take) {
    constexpr std::size_t kPiece = 64 * 1024;
    const int handle = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
    if (handle < 0) return std::strerror(errno);
    std::string text;
    std::string why;
    for (bool wanted = true; wanted;) {
        const std::size_t had = text.size();
        text.resize(had + kPiece);
        const ssize_t got = ::read(handle, text.data() + had, kPiece);
        const int error = errno;
        text.resize(had + static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
        if (got < 0 && error == EINTR) continue;
        if (got < 0) why = std::strerror(error);
        if (got <= 0) {
            if (got == 0 && !text.empty()) take(text, false);
            break;
        }
        wanted = take_lines(text, take);
    }
    ::close(handle);
    return why;
}

}  // namespace panelgate::audit
