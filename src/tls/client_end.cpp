#include "panelgate/tls/client_end.hpp"

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <cerrno>
#include <utility>

#include "native.hpp"

namespace panelgate::tls {

ClientEnd::ClientEnd(std::shared_ptr<const ClientContext> context, const std::string& server,
                     int socket)
    : context_(std::move(context)), tls_(SSL_new(context_->native()), SSL_free) {
    SSL_set_mode(tls_.get(), SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
    SSL_set_fd(tls_.get(), socket);
    if (expect_peer(SSL_get0_param(tls_.get()), server))
        SSL_set_tlsext_host_name(tls_.get(), server.c_str());
    SSL_set_connect_state(tls_.get());
}

ClientEnd::~ClientEnd() = default;

ClientEnd::Step ClientEnd::shake() {
    ERR_clear_error();
    const int result = SSL_do_handshake(tls_.get());
    if (result == 1) return Step::done;
    const int error = SSL_get_error(tls_.get(), result);
    if (error == SSL_ERROR_WANT_READ) return Step::wants_input;
    if (error == SSL_ERROR_WANT_WRITE) return Step::wants_output;
    why_ = context_->refusal();
    const char* const reason = ERR_reason_error_string(ERR_peek_error());
    if (why_.empty() && error == SSL_ERROR_SSL && reason != nullptr)
        why_ = std::string("TLS: ") + reason;
    if (why_.empty()) why_ = "the device closes the connection during the TLS handshake";
    return Step::failed;
}

ssize_t ClientEnd::result_of(int result) const {
    const int error = SSL_get_error(tls_.get(), result);
    if (error == SSL_ERROR_ZERO_RETURN) return 0;
    if (error == SSL_ERROR_SYSCALL && errno != 0) return -1;
    const bool waits = error == SSL_ERROR_WANT_READ || error == SSL_ERROR_WANT_WRITE;
    if (error == SSL_ERROR_SYSCALL) return 0;
    errno = waits ? EAGAIN : EPROTO;
    return -1;
}

ssize_t ClientEnd::read(std::span<std::uint8_t> room) {
    ERR_clear_error();
    errno = 0;
    const int result = SSL_read(tls_.get(), room.data(), static_cast<int>(room.size()));
    return result > 0 ? result : result_of(result);
}

ssize_t ClientEnd::write(ByteView bytes) {
    ERR_clear_error();
    errno = 0;
    const int result = SSL_write(tls_.get(), bytes.data(), static_cast<int>(bytes.size()));
    return result > 0 ? result : result_of(result);
}

}  // namespace panelgate::tls
