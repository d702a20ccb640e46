#include "panelgate/tls/stream.hpp"

#include <linux/sockios.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <algorithm>
#include <boost/asio/error.hpp>
#include <cerrno>
#include <span>

#include "engine.hpp"
#include "proof.hpp"

namespace panelgate::tls {
namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

namespace {

/// The client's own: it ends the connection.
bool is_alert(int reason) { return reason >= SSL_AD_REASON_OFFSET; }

/// What others left would be taken for this connection's. Looking is cheaper than clearing.
void forget_errors() {
    if (ERR_peek_error() != 0) ERR_clear_error();
}

}  // namespace

Stream::Stream(tcp::socket socket) : socket_(std::move(socket)), timer_(socket_.get_executor()) {
    error_code ignored;
    socket_.non_blocking(true, ignored);
}

Stream::~Stream() = default;

void Stream::secure(std::shared_ptr<Engine> engine) {
    engine_ = std::move(engine);
    engine_->use_socket(socket_.native_handle());
    peer_ = peer_of(SSL_get0_peer_certificate(engine_->native()));
}

std::shared_ptr<const Proof> Stream::proof() const {
    return engine_ ? std::make_shared<const Proof>(engine_->native()) : nullptr;
}

bool Stream::holds_input() const { return engine_->holds_input(); }

asio::mutable_buffer Stream::room() {
    const std::span<char> room = engine_->room();
    return {room.data(), room.size()};
}

void Stream::arrived(std::size_t size) { engine_->arrived(size); }

/// Of SSL_read, SSL_peek and SSL_write.
Stream::Step Stream::step_of(int result) {
    if (result > 0) return {static_cast<std::size_t>(result), {}, Need::nothing};
    const int why = SSL_get_error(engine_->native(), result);
    const bool is_damaged = why == SSL_ERROR_SSL && !is_alert(ERR_GET_REASON(ERR_peek_error()));
    forget_errors();
    if (why == SSL_ERROR_WANT_READ) return {0, {}, Need::readable};
    if (why == SSL_ERROR_WANT_WRITE) return {0, {}, Need::writable};
    if (why == SSL_ERROR_ZERO_RETURN) return {0, asio::error::eof, Need::nothing};
    if (is_damaged) return {0, make_error_code(kDamaged), Need::nothing};
    return {0, asio::error::connection_reset, Need::nothing};
}

Stream::Step Stream::read_secure(asio::mutable_buffer into) {
    if (!socket_.is_open()) return {0, asio::error::bad_descriptor, Need::nothing};
    if (into.size() == 0) return {};
    forget_errors();
    constexpr std::size_t kMost = 1 << 20;
    return step_of(
        SSL_read(engine_->native(), into.data(), static_cast<int>(std::min(into.size(), kMost))));
}

Stream::Step Stream::write_secure(asio::const_buffer bytes) {
    if (!socket_.is_open()) return {0, asio::error::bad_descriptor, Need::nothing};
    if (bytes.size() == 0) return {};
    forget_errors();
    constexpr std::size_t kMost = 1 << 20;
    return step_of(SSL_write(engine_->native(), bytes.data(),
                             static_cast<int>(std::min(bytes.size(), kMost))));
}

std::size_t Stream::write_some(asio::const_buffer bytes, error_code& error) {
    if (!engine_) return socket_.write_some(bytes, error);
    const Step step = write_secure(bytes);
    error = step.need == Need::nothing ? step.error : error_code(asio::error::would_block);
    return step.bytes;
}

Stream::Input Stream::look() {
    char byte = 0;
    if (engine_) {
        forget_errors();
        const Step step = step_of(SSL_peek(engine_->native(), &byte, 1));
        if (step.need != Need::nothing) return Input::none;
        if (step.error == asio::error::eof) return Input::end;
        return step.error ? Input::broken : Input::bytes;
    }
    const auto size = ::recv(socket_.native_handle(), &byte, 1, MSG_PEEK | MSG_DONTWAIT);
    if (size > 0) return Input::bytes;
    if (size == 0) return Input::end;
    return errno == EAGAIN || errno == EWOULDBLOCK ? Input::none : Input::broken;
}

std::size_t Stream::available() const {
    error_code ignored;
    return socket_.available(ignored);
}

bool Stream::all_is_sent() const {
    int bytes = 0;
    const int socket = const_cast<tcp::socket&>(socket_).native_handle();
    return ::ioctl(socket, SIOCOUTQ, &bytes) == 0 && bytes == 0;
}

void Stream::expires_after(Duration patience) {
    timer_.expires_after(patience);
    timer_.async_wait(
        [this, alive = std::weak_ptr(alive_), mine = timer_.expiry()](const error_code& cancelled) {
            if (cancelled || alive.expired() || timer_.expiry() != mine) return;
            if (pending_ > 0) close();
        });
}

void Stream::shutdown_send() {
    error_code ignored;
    if (engine_) {
        forget_errors();
        SSL_shutdown(engine_->native());
        forget_errors();
    }
    socket_.shutdown(tcp::socket::shutdown_send, ignored);
}

void Stream::close() {
    if (!socket_.is_open()) return;
    if (engine_) {
        forget_errors();
        SSL_shutdown(engine_->native());
        forget_errors();
        engine_->use_socket(-1);
    }
    error_code ignored;
    timer_.cancel();
    socket_.close(ignored);
}

}  // namespace panelgate::tls
