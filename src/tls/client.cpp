#include "panelgate/tls/client.hpp"

#include <openssl/ssl.h>
#include <openssl/x509_vfy.h>
#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <boost/system/error_code.hpp>
#include <memory>
#include <utility>

#include "engine.hpp"
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
int judge_server(X509_STORE_CTX* chain, void* argument) {
    const auto* const believed = static_cast<const Believed*>(argument);
    const X509* const shown = X509_STORE_CTX_get0_cert(chain);
    if (believed->anybody) return 1;
    if (believed->pinned && X509_cmp(believed->pinned.get(), shown) == 0) return 1;
    return X509_verify_cert(chain);
}

class Connecting : public std::enable_shared_from_this<Connecting> {
  public:
    Connecting(Stream& stream, const Trust& trust, const std::string& server,
               std::function<void(const std::string&)> done)
        : stream_(stream), done_(std::move(done)) {
        const std::shared_ptr<SSL_CTX> context(SSL_CTX_new(TLS_client_method()), SSL_CTX_free);
        SSL_CTX_set_min_proto_version(context.get(), TLS1_2_VERSION);
        SSL_CTX_set_options(context.get(), SSL_OP_IGNORE_UNEXPECTED_EOF);
        SSL_CTX_set_mode(context.get(),
                         SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
        auto own = certificates_of(trust.certificate);
        if (!own.empty()) believed_->pinned = std::move(own.front());
        believed_->anybody = trust.anybody;
        for (const auto& one : certificates_of(trust.ca))
            X509_STORE_add_cert(SSL_CTX_get_cert_store(context.get()), one.get());
        SSL_CTX_set_cert_verify_callback(context.get(), judge_server, believed_.get());
        SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER, nullptr);
        engine_ = std::make_shared<Engine>(context);
        if (!trust.any_name) expect(server);
        kept_ = context;
    }

    void step() {
        const Engine::Progress progress = engine_->handshake();
        const asio::const_buffer bytes = asio::buffer(engine_->output);
        asio::async_write(
            stream_.socket(), bytes,
            [self = shared_from_this(), progress](const error_code& error, std::size_t) {
                self->engine_->output.clear();
                if (progress == Engine::Progress::failed) return self->done_(self->reason());
                if (error) return self->done_(error.message());
                if (progress == Engine::Progress::needs_input) return self->listen();
                self->stream_.secure(self->engine_);
                self->done_("");
            });
    }

  private:
    void expect(const std::string& server) {
        SSL* const tls = engine_->native();
        if (expect_peer(SSL_get0_param(tls), server)) SSL_set_tlsext_host_name(tls, server.c_str());
    }
    void listen() {
        stream_.socket().async_read_some(
            asio::buffer(chunk_),
            [self = shared_from_this()](const error_code& error, std::size_t size) {
                if (error) return self->done_("closed during the TLS handshake");
                self->engine_->input.append(self->chunk_.data(), size);
                self->step();
            });
    }
    std::string reason() const {
        const long chain = SSL_get_verify_result(engine_->native());
        if (chain == X509_V_OK) return "TLS: " + engine_->why();
        return std::string(
                   "its certificate is not the one of the configuration, and cannot be "
                   "trusted: ") +
               X509_verify_cert_error_string(chain) + " (--ca FILE names the CA that signed it)";
    }

    Stream& stream_;
    std::function<void(const std::string&)> done_;
    std::shared_ptr<Believed> believed_ = std::make_shared<Believed>();
    std::shared_ptr<SSL_CTX> kept_;
    std::shared_ptr<Engine> engine_;
    std::array<char, 16 * 1024> chunk_{};
};

}  // namespace

void connect(Stream& stream, const Trust& trust, const std::string& server,
             std::function<void(const std::string&)> done) {
    std::make_shared<Connecting>(stream, trust, server, std::move(done))->step();
}

}  // namespace panelgate::tls
