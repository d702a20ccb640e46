#pragma once

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <string>

#include "panelgate/base/bytes.hpp"

namespace panelgate::line {

/// An open serial port, non-blocking as the gateway opens it.
class Port {
  public:
    explicit Port(const std::string& path)
        : fd_(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)), error_(errno) {}
    ~Port() { close(); }
    Port(const Port&) = delete;
    Port& operator=(const Port&) = delete;

    bool is_open() const { return fd_ >= 0; }
    int fd() const { return fd_; }
    int error() const { return is_open() ? 0 : error_; }
    void close() {
        if (fd_ >= 0) ::close(fd_);
        fd_ = -1;
    }

    /// Waits for 3 s at most for each byte; what came is shorter when nothing more did.
    Bytes read(std::size_t count, int timeout_ms = 3000) {
        Bytes got;
        while (got.size() < count) {
            pollfd p{fd_, POLLIN, 0};
            if (::poll(&p, 1, timeout_ms) <= 0) break;
            std::uint8_t byte = 0;
            if (::read(fd_, &byte, 1) != 1) break;
            got.push_back(byte);
        }
        return got;
    }
    /// All of it, or false.
    bool write(ByteView bytes) {
        while (!bytes.empty()) {
            pollfd p{fd_, POLLOUT, 0};
            if (::poll(&p, 1, 3000) <= 0) return false;
            const ssize_t n = ::write(fd_, bytes.data(), bytes.size());
            if (n <= 0) return false;
            bytes = bytes.subspan(static_cast<std::size_t>(n));
        }
        return true;
    }

  private:
    int fd_;
    int error_;
};

}  // namespace panelgate::line
