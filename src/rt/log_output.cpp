#include "panelgate/rt/log_output.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
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
    // O_NONBLOCK on the descriptor itself would hold for everybody who has inherited it.
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

/// How many bytes are gone; nothing when it cannot take them at all.
std::optional<std::size_t> LogOutput::hand_over(std::string_view bytes) {
    ssize_t sent = 0;
    switch (kind_) {
        case Kind::own:
            sent = ::write(own_, bytes.data(), bytes.size());
            break;
        case Kind::file:
            // Takes all at once, and at the one place where others write to it, too (2>&1).
            sent = ::write(descriptor_, bytes.data(), bytes.size());
            break;
        case Kind::socket:
            sent = ::send(descriptor_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
            break;
        case Kind::shared:
            // A pipe that polls writable takes so much in one piece (pipe(7)).
            if (!takes_some(descriptor_)) return 0;
            sent =
                ::write(descriptor_, bytes.data(), std::min<std::size_t>(bytes.size(), PIPE_BUF));
            break;
        case Kind::terminal:
            // One that polls writable takes a byte at least, and would wait for room for the rest.
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
    if (untold_ == 0 || !took || !lost_line_) return;
    keep(lost_line_(std::exchange(untold_, 0)));
    flush();
}

void LogOutput::drop() {
    ++dropped_;
    ++untold_;
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

}  // namespace panelgate::rt
