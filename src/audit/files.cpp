#include "panelgate/audit/files.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "panelgate/audit/chain.hpp"
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

/// Their numbers have leading zeros: the order of names is that of records. A name may end in "-2".
std::vector<std::string> rotated_files(const std::string& file) {
    const fs::path path(file);
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    const std::string begin = path.filename().string() + '.';
    std::vector<std::string> found;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
        const std::string name = entry.path().filename().string();
        if (name.size() < begin.size() + kDigits || !name.starts_with(begin)) continue;
        if (to_number<std::uint64_t>(name.substr(begin.size(), kDigits)))
            found.push_back(path.has_parent_path() ? entry.path().string() : name);
    }
    std::ranges::sort(found);
    return found;
}

std::uint64_t first_record(const std::string& file) {
    std::uint64_t first = 0;
    read_lines(file, [&](std::string_view line, bool) {
        const auto record = parse_line(line);
        first = record ? record->number : 0;
        return false;
    });
    return first;
}

std::string read_lines(const std::string& file,
                       const std::function<bool(std::string_view line, bool whole)>& take) {
    errno = 0;
    std::ifstream in(file, std::ios::binary);
    if (!in) return std::strerror(errno);
    for (std::string line; std::getline(in, line);)
        if (!take(line, !in.eof())) return {};
    return in.bad() ? std::strerror(errno) : std::string();
}

}  // namespace panelgate::audit
