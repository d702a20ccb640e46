#include "departure.hpp"

#include <sys/socket.h>

#include <boost/system/error_code.hpp>
#include <cerrno>
#include <utility>

namespace panelgate::web {

using boost::asio::ip::tcp;
using boost::system::error_code;

Departure::Departure(tcp::socket& socket, Duration grace)
    : socket_(socket), grace_(grace), timer_(socket.get_executor()) {}

/// A reset shows also while there is something unread.
void Departure::start(std::shared_ptr<void> owner, std::function<void()> left) {
    owner_ = owner;
    left_ = std::move(left);
    socket_.async_wait(tcp::socket::wait_error, [this, owner](const error_code& cancelled) {
        if (!cancelled && was_reset()) tell();
    });
}

void Departure::request_runs() {
    running_ = true;
    watch_input();
}

void Departure::request_ends() {
    running_ = false;
    timer_.cancel();
}

/// Stops looking once a pipelined request is there.
void Departure::watch_input() {
    if (watching_ || !socket_.is_open()) return;
    watching_ = true;
    socket_.async_wait(tcp::socket::wait_read,
                       [this, owner = owner_.lock()](const error_code& error) {
                           watching_ = false;
                           if (!error && running_ && socket_.is_open()) look_at_input();
                       });
}

void Departure::look_at_input() {
    char byte = 0;
    const auto n = ::recv(socket_.native_handle(), &byte, 1, MSG_PEEK | MSG_DONTWAIT);
    if (n > 0) return;
    if (n == 0) return ask_later();
    if (errno != EAGAIN && errno != EWOULDBLOCK) return tell();
    watch_input();  // it was the beginning of this very request
}

void Departure::ask_later() {
    timer_.expires_after(grace_);
    timer_.async_wait([this, owner = owner_.lock()](const error_code& cancelled) {
        if (cancelled || !running_ || !socket_.is_open()) return;
        if (ask_) ask_();
        ask_later();
    });
}

/// The wait also ends when both sides have closed their sending sides.
bool Departure::was_reset() {
    int why = 0;
    socklen_t size = sizeof why;
    const int socket = socket_.native_handle();
    return ::getsockopt(socket, SOL_SOCKET, SO_ERROR, &why, &size) != 0 || why != 0;
}

void Departure::tell() {
    if (const auto left = std::exchange(left_, nullptr)) left();
}

}  // namespace panelgate::web
