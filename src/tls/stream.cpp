#include "panelgate/tls/stream.hpp"

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>
#include <boost/asio/error.hpp>
#include <boost/asio/ssl/error.hpp>
#include <cerrno>

#include "native.hpp"

namespace panelgate::tls {
namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

Stream::Stream(tcp::socket socket) : plain_(std::move(socket)), timer_(plain_.get_executor()) {
    error_code ignored;
    plain_.non_blocking(true, ignored);
}

namespace {

/// The first end of validity of the certificates that were verified; 0 without one.
std::int64_t expiry_of(SSL* ssl) {
    const STACK_OF(X509)* const chain = SSL_get0_verified_chain(ssl);
    std::int64_t first = 0;
    for (int i = 0; i < sk_X509_num(chain); ++i) {
        const std::int64_t end = seconds_of(X509_get0_notAfter(sk_X509_value(chain, i)));
        if (i == 0 || end < first) first = end;
    }
    return first;
}

}  // namespace

Stream::Stream(std::unique_ptr<Secure> secure)
    : plain_(secure->get_executor()),
      secure_(std::move(secure)),
      peer_(peer_of(certificate())),
      timer_(plain_.get_executor()) {
    peer_.expiry = expiry_of(secure_->native_handle());
}

x509_st* Stream::certificate() const {
    return secure_ ? SSL_get0_peer_certificate(secure_->native_handle()) : nullptr;
}

/// Translates what a TLS operation ends with into the words of sockets. An alert of the client ends
/// the connection as a reset does.
error_code Stream::told(error_code error) const {
    if (error == asio::ssl::error::stream_truncated) return asio::error::eof;
    if (error.category() != asio::error::get_ssl_category()) return error;
    const int reason = ERR_GET_REASON(static_cast<unsigned long>(error.value()));
    if (reason >= SSL_AD_REASON_OFFSET) return asio::error::connection_reset;
    return make_error_code(kDamaged);
}

std::size_t Stream::write_some(asio::const_buffer bytes, error_code& error) {
    if (!secure_) return plain_.write_some(bytes, error);
    error = asio::error::would_block;
    return 0;
}

void Stream::write_aside(asio::const_buffer text) {
    error_code ignored;
    if (!secure_)
        plain_.write_some(text, ignored);
    else
        secure_->async_write_some(text, [kept = secure_](const error_code&, std::size_t) {});
}

Stream::Input Stream::look() {
    const int socket = this->socket().native_handle();
    if (secure_) {
        pollfd end{socket, POLLRDHUP, 0};
        if (::poll(&end, 1, 0) == 1 && (end.revents & POLLRDHUP) != 0) return Input::end;
    }
    char byte = 0;
    const auto size = ::recv(socket, &byte, 1, MSG_PEEK | MSG_DONTWAIT);
    if (size > 0) return Input::bytes;
    if (size == 0) return Input::end;
    return errno == EAGAIN || errno == EWOULDBLOCK ? Input::none : Input::broken;
}

std::size_t Stream::available() const {
    error_code ignored;
    return socket().available(ignored);
}

void Stream::expires_after(Duration patience) {
    timer_.expires_after(patience);
    timer_.async_wait(
        [this, alive = std::weak_ptr(alive_), mine = timer_.expiry()](const error_code& cancelled) {
            if (cancelled || alive.expired() || timer_.expiry() != mine) return;
            if (pending_ > 0) close();
        });
}

/// Asio hands the alert to the socket at once, unless a write is pending; then the alert is lost.
void Stream::say_goodbye() {
    if (!secure_ || (SSL_get_shutdown(secure_->native_handle()) & SSL_SENT_SHUTDOWN) != 0) return;
    secure_->async_shutdown([kept = secure_](const error_code&) {});
}

void Stream::shutdown_send() {
    error_code ignored;
    say_goodbye();
    socket().shutdown(tcp::socket::shutdown_send, ignored);
}

void Stream::close() {
    if (!socket().is_open()) return;
    error_code ignored;
    timer_.cancel();
    say_goodbye();
    socket().close(ignored);
}

}  // namespace panelgate::tls
