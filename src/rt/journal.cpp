#include "panelgate/rt/journal.hpp"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>

namespace panelgate::rt {
namespace {

constexpr const char* kJournal = "/run/systemd/journal/socket";
constexpr std::size_t kLongestName = 64;  // of a field

std::string name_of(std::string_view key) {
    std::string name = "PANELGATE_";
    for (const char c : key.substr(0, kLongestName - name.size())) {
        const bool lower = c >= 'a' && c <= 'z';
        const bool taken = (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
        name += lower ? static_cast<char>(c - 'a' + 'A') : taken ? c : '_';
    }
    return name;
}

/// A value of several lines goes behind its length.
void append(std::string& fields, std::string_view name, std::string_view value) {
    fields += name;
    if (value.find('\n') == std::string_view::npos) {
        fields += '=';
    } else {
        fields += '\n';
        auto rest = static_cast<std::uint64_t>(value.size());
        for (int i = 0; i < 8; ++i, rest >>= 8) fields += static_cast<char>(rest & 0xff);
    }
    fields += value;
    fields += '\n';
}

}  // namespace

int journal_priority(LogLevel level) {
    switch (level) {
        case LogLevel::error:
            return 3;
        case LogLevel::warn:
            return 4;
        case LogLevel::info:
            return 6;
        case LogLevel::debug:
        case LogLevel::trace:
            return 7;
    }
    std::abort();
}

bool is_journal_stream(std::string_view stream, dev_t device, ino_t inode) {
    return stream == std::to_string(device) + ':' + std::to_string(inode);
}

bool stderr_is_journal() {
    const char* stream = std::getenv("JOURNAL_STREAM");
    struct stat file{};
    if (stream == nullptr || ::fstat(STDERR_FILENO, &file) != 0) return false;
    return is_journal_stream(stream, file.st_dev, file.st_ino);
}

int connect_to_journal() {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::ranges::copy(std::string_view(kJournal), address.sun_path);
    const int journal = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const auto* where = reinterpret_cast<const sockaddr*>(&address);
    if (journal < 0 || ::connect(journal, where, sizeof(address)) == 0) return journal;
    ::close(journal);
    return -1;
}

std::string journal_fields(LogLevel level, std::string_view event,
                           std::span<const LogField> fields) {
    std::string all;
    append(all, "PRIORITY", std::to_string(journal_priority(level)));
    append(all, "SYSLOG_IDENTIFIER", "panelgate");
    append_journal_field(all, "event", event);
    for (const auto& [key, value] : fields) append_journal_field(all, key, value);
    return all;
}

void append_journal_field(std::string& fields, std::string_view key, std::string_view value) {
    append(fields, name_of(key), value);
}

}  // namespace panelgate::rt
