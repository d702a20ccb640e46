#include "readiness.hpp"

#include <sys/epoll.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace panelgate::line {

namespace asio = boost::asio;
using boost::system::error_code;

Readiness::Readiness(const asio::any_io_executor& executor, std::function<void()> ready)
    : epoll_(executor), ready_(std::move(ready)) {}

Readiness::~Readiness() { *alive_ = false; }

std::string Readiness::watch(int fd) {
    forget();
    if (!epoll_.is_open()) {
        const int set = ::epoll_create1(EPOLL_CLOEXEC);
        if (set < 0) return std::strerror(errno);
        error_code error;
        epoll_.assign(set, error);
        if (error) {
            ::close(set);
            return error.message();
        }
    }
    epoll_event event{};
    event.events = EPOLLIN;
    if (::epoll_ctl(epoll_.native_handle(), EPOLL_CTL_ADD, fd, &event) != 0)
        return errno == EPERM ? "" : std::strerror(errno);
    fd_ = fd;
    events_ = EPOLLIN;
    wait();
    return {};
}

void Readiness::forget() {
    if (fd_ < 0) return;
    ::epoll_ctl(epoll_.native_handle(), EPOLL_CTL_DEL, std::exchange(fd_, -1), nullptr);
}

void Readiness::want_input(bool wanted) {
    want(wanted ? events_ | EPOLLIN : events_ & ~std::uint32_t{EPOLLIN});
}

void Readiness::want_output(bool wanted) {
    want(wanted ? events_ | EPOLLOUT : events_ & ~std::uint32_t{EPOLLOUT});
}

void Readiness::want(std::uint32_t events) {
    if (fd_ < 0 || events == events_) return;
    events_ = events;
    epoll_event event{};
    event.events = events;
    ::epoll_ctl(epoll_.native_handle(), EPOLL_CTL_MOD, fd_, &event);
    wait();
}

/// Once at a time. It looks anew whenever it begins: what came before is not missed.
void Readiness::wait() {
    if (waiting_) return;
    waiting_ = true;
    epoll_.async_wait(asio::posix::stream_descriptor::wait_read,
                      [this, alive = alive_](error_code error) {
                          if (!*alive) return;
                          waiting_ = false;
                          if (error || fd_ < 0) return;
                          ready_();
                          if (*alive && fd_ >= 0 && events_ != 0) wait();
                      });
}

}  // namespace panelgate::line
