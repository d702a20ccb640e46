#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509_vfy.h>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/error.hpp>
#include <cerrno>
#include <memory>
#include <utility>

#include "native.hpp"
#include "panelgate/tls/context.hpp"
#include "panelgate/tls/stream.hpp"

namespace panelgate::tls {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

struct Believed {
    Owned<X509> pinned;  ///< trusted as it is; may be null
    bool anybody = false;
};

/// The chain counts only where the certificate is not the very one that is expected.
int judge_server_by(X509_STORE_CTX* chain, void* argument) {
    const auto* const believed = static_cast<const Believed*>(argument);
    if (believed->anybody) return 1;
    if (believed->pinned && X509_cmp(believed->pinned.get(), X509_STORE_CTX_get0_cert(chain)) == 0)
        return 1;
    return X509_verify_cert(chain);
}

/// What a handshake of a client needs until it is over.
struct Connecting {
    Believed believed;
    asio::ssl::context context{asio::ssl::context::tls_client};
    std::unique_ptr<Stream::Secure> stream{};

    std::string reason(const error_code& error) const {
        const long chain = SSL_get_verify_result(stream->native_handle());
        if (chain != X509_V_OK)
            return std::string(
                       "its certificate is not the one of the configuration, and cannot be "
                       "trusted: ") +
                   X509_verify_cert_error_string(chain) +
                   " (--ca FILE names the CA that signed it)";
        if (error.category() == asio::error::get_ssl_category()) return "TLS: " + error.message();
        return "closed during the TLS handshake";
    }
};

}  // namespace

void connect(asio::ip::tcp::socket socket, const Trust& trust, const std::string& server,
             std::function<void(const std::string& why, Stream stream)> done) {
    const auto all = std::make_shared<Connecting>();
    auto own = certificates_of(trust.certificate);
    if (!own.empty()) all->believed.pinned = std::move(own.front());
    all->believed.anybody = trust.anybody;
    SSL_CTX* const context = all->context.native_handle();
    SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION);
    for (const auto& one : certificates_of(trust.ca))
        X509_STORE_add_cert(SSL_CTX_get_cert_store(context), one.get());
    SSL_CTX_set_cert_verify_callback(context, judge_server_by, &all->believed);
    SSL_CTX_set_verify(context, SSL_VERIFY_PEER, nullptr);
    all->stream = std::make_unique<Stream::Secure>(std::move(socket), all->context);
    SSL* const tls = all->stream->native_handle();
    if (!trust.any_name && expect_peer(SSL_get0_param(tls), server))
        SSL_set_tlsext_host_name(tls, server.c_str());
    all->stream->async_handshake(asio::ssl::stream_base::client,
                                 [all, done = std::move(done)](const error_code& error) {
                                     const std::string why = error ? all->reason(error) : "";
                                     done(why, Stream(std::move(all->stream)));
                                 });
}

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
