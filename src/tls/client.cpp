#include <openssl/ssl.h>
#include <openssl/x509_vfy.h>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/error.hpp>
#include <memory>
#include <utility>

#include "native.hpp"
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

}  // namespace panelgate::tls
