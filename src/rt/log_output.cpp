#include "panelgate/rt/log_output.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstdint>
#include <cstdlib>
#include <utility>

namespace panelgate::rt {

namespace {

bool takes_some(int descriptor) {
    pollfd asked{descriptor, POLLOUT, 0};
    return ::poll(&asked, 1, 0) == 1 && (asked.revents & (POLLOUT | POLLERR | POLLHUP)) != 0;
}

}  // namespace

LogOutput::LogOutput(int descriptor, std::size_t most_pending)
    : descriptor_(descriptor), most_(most_pending) {
    struct stat file{};
    if (::fstat(descriptor, &file) == 0) {
        if (S_ISSOCK(file.st_mode)) kind_ = Kind::socket;
        if (S_ISREG(file.st_mode)) kind_ = Kind::file;
        if (kind_ != Kind::shared) return;
    }
    // O_NONBLOCK on the descriptor itself would affect every process that inherited it.
    const std::string path = "/proc/self/fd/" + std::to_string(descriptor);
    own_ = ::open(path.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC | O_APPEND);
    if (own_ >= 0) {
        kind_ = Kind::own;
    } else if (::isatty(descriptor) == 1) {
        kind_ = Kind::terminal;
    }
}

LogOutput::~LogOutput() {
    if (own_ >= 0) ::close(own_);
}

/// Returns the number of bytes written; std::nullopt if writing fails.
std::optional<std::size_t> LogOutput::hand_over(std::string_view bytes) {
    ssize_t sent = 0;
    switch (kind_) {
        case Kind::own:
            sent = ::write(own_, bytes.data(), bytes.size());
            break;
        case Kind::file:
            // Takes all at once, at the shared offset where others write too (2>&1).
            sent = ::write(descriptor_, bytes.data(), bytes.size());
            break;
        case Kind::socket:
            sent = ::send(descriptor_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
            break;
        case Kind::shared:
            // A pipe that polls writable takes this much in one piece (pipe(7)).
            if (!takes_some(descriptor_)) return 0;
            sent =
                ::write(descriptor_, bytes.data(), std::min<std::size_t>(bytes.size(), PIPE_BUF));
            break;
        case Kind::terminal:
            // A terminal that polls writable takes at least one byte, and would block for more.
            if (!takes_some(descriptor_)) return 0;
            sent = ::write(descriptor_, bytes.data(), 1);
            break;
    }
    if (sent >= 0) return static_cast<std::size_t>(sent);
    if (errno == EAGAIN || errno == EINTR || errno == ENOBUFS) return 0;
    return std::nullopt;
}

void LogOutput::flush() {
    bool took = false;
    while (!pending_.empty()) {
        std::string& first = pending_.front();
        const auto gone = hand_over(first);
        if (gone && *gone == 0) return;
        bytes_ -= gone.value_or(first.size());
        if (!gone) {
            drop();
            cut_ = cut_ || begun_;
        } else if (*gone < first.size()) {
            first.erase(0, *gone);
            begun_ = true;
            continue;
        }
        took = took || gone;
        pending_.pop_front();
        begun_ = false;
    }
    if (unreported_ == 0 || !took || !lost_line_) return;
    keep(lost_line_(std::exchange(unreported_, 0)));
    flush();
}

void LogOutput::drop() {
    ++dropped_;
    ++unreported_;
}

void LogOutput::write(std::string_view line) {
    if (pending()) flush();
    if (bytes_ + line.size() > most_) return drop();
    const bool first = !pending();
    keep(std::string(line));
    flush();
    if (first && pending() && on_pending_) on_pending_();
}

void LogOutput::keep(std::string line) {
    if (std::exchange(cut_, false)) line.insert(0, 1, '\n');
    bytes_ += line.size();
    pending_.push_back(std::move(line));
}

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

/// A value of several lines follows its length.
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
