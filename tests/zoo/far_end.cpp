#include "far_end.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/filter.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <system_error>
#include <utility>

namespace zoo {
namespace {

[[noreturn]] void fail(const char* what) {
    throw std::system_error(errno, std::generic_category(), what);
}

void close_it(int& descriptor) {
    if (descriptor >= 0) ::close(descriptor);
    descriptor = -1;
}

class Pty : public FarEnd {
  public:
    explicit Pty(std::string link) : link_(std::move(link)) { Pty::plug(); }
    ~Pty() override { Pty::unplug(); }
    Pty(const Pty&) = delete;
    Pty& operator=(const Pty&) = delete;

    int descriptor() const override { return master_; }
    std::string name() const override { return link_; }

    void plug() override {
        if (master_ >= 0) return;
        master_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
        std::array<char, 64> path{};
        if (master_ < 0 || ::grantpt(master_) != 0 || ::unlockpt(master_) != 0 ||
            ::ptsname_r(master_, path.data(), path.size()) != 0) {
            fail("pty");
        }
        // Held open, so that nobody's closing it hangs up; raw, so that nothing is changed before
        // it is set.
        slave_ = ::open(path.data(), O_RDWR | O_NOCTTY | O_CLOEXEC);
        termios raw{};
        if (slave_ < 0 || ::tcgetattr(slave_, &raw) != 0) fail("pty");
        ::cfmakeraw(&raw);
        ::tcsetattr(slave_, TCSANOW, &raw);
        const std::string fresh = link_ + ".new";
        ::unlink(fresh.c_str());
        if (::symlink(path.data(), fresh.c_str()) != 0 ||
            ::rename(fresh.c_str(), link_.c_str()) != 0) {
            fail(link_.c_str());
        }
    }

    void unplug() override {
        ::unlink(link_.c_str());
        close_it(slave_);
        close_it(master_);
    }

  private:
    std::string link_;
    int master_ = -1;
    int slave_ = -1;
};

// While it hangs on a socket the kernel drops every segment unread: data, acknowledgements,
// requests to connect.
void drop_all(int socket, bool severed) {
    if (socket < 0) return;
    sock_filter none{BPF_RET | BPF_K, 0, 0, 0};
    const sock_fprog program{1, &none};
    const int detach = 0;
    if (severed) {
        ::setsockopt(socket, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program);
    } else {
        ::setsockopt(socket, SOL_SOCKET, SO_DETACH_FILTER, &detach, sizeof detach);
    }
}

class Tcp : public FarEnd {
  public:
    explicit Tcp(int port) {
        listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
        const int one = 1;
        ::setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &one, sizeof one);
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_port = htons(static_cast<std::uint16_t>(port));
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t size = sizeof address;
        auto* generic = reinterpret_cast<sockaddr*>(&address);
        if (::bind(listener_, generic, size) != 0 || ::listen(listener_, 8) != 0 ||
            ::getsockname(listener_, generic, &size) != 0) {
            fail("listen");
        }
        port_ = ntohs(address.sin_port);
    }
    ~Tcp() override {
        close_it(socket_);
        close_it(listener_);
    }
    Tcp(const Tcp&) = delete;
    Tcp& operator=(const Tcp&) = delete;

    int descriptor() const override { return socket_; }
    int listener() const override { return listener_; }
    std::string name() const override { return "127.0.0.1:" + std::to_string(port_); }

    // A newer connection takes the place of an older one, as device servers have it.
    void accept() override {
        const int fresh = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
        if (fresh < 0) return;
        const int one = 1;
        ::setsockopt(fresh, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
        close_it(socket_);
        socket_ = fresh;
    }

    void unplug() override { close_it(socket_); }
    void plug() override {}
    void lost() override { close_it(socket_); }
    void sever(bool severed) override {
        drop_all(listener_, severed);
        drop_all(socket_, severed);
    }

  private:
    int listener_ = -1;
    int socket_ = -1;
    int port_ = 0;
};

}  // namespace

Bytes FarEnd::read() {
    std::array<std::uint8_t, 4096> buffer{};
    const ssize_t count = ::read(descriptor(), buffer.data(), buffer.size());
    if (count <= 0) {
        if (count == 0 || (errno != EAGAIN && errno != EINTR)) lost();
        return {};
    }
    return {buffer.begin(), buffer.begin() + count};
}

bool FarEnd::write(const Bytes& bytes) {
    if (descriptor() < 0) return false;
    const ssize_t count = ::write(descriptor(), bytes.data(), bytes.size());
    if (count < 0 && errno != EAGAIN && errno != EINTR) lost();
    return true;
}

std::unique_ptr<FarEnd> make_pty(const std::string& link) { return std::make_unique<Pty>(link); }

std::unique_ptr<FarEnd> make_tcp(int port) { return std::make_unique<Tcp>(port); }

}  // namespace zoo
