#pragma once

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <csignal>
#include <ctime>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "panelgate/tls/handshakes.hpp"
#include "panelgate/tls/issue.hpp"
#include "panelgate/tls/stream.hpp"

namespace panelgate::tls {

inline Validity valid(int days = 30) { return {std::time(nullptr), days}; }

/// A plant: its CA, and the gateway's certificate.
struct TestPlant {
    Issued ca = issue_ca("Plant CA", valid(365));
    Issued server = issue_server(ca, {"gateway.plant", "127.0.0.1"}, valid());

    Settings settings(ClientCertificate client = ClientCertificate::none) const {
        Settings made;
        made.certificate = "gateway.crt";
        made.key = "gateway.key";
        made.ca = "ca.crt";
        made.client = client;
        made.material = {server.certificate, server.key, ca.certificate, ""};
        return made;
    }
};

/// A foreign client, in a thread of its own: OpenSSL on a blocking socket.
class TestClient {
  public:
    explicit TestClient(const Issued& identity = {}) : context_(SSL_CTX_new(TLS_client_method())) {
        std::signal(SIGPIPE, SIG_IGN);  // OpenSSL writes to a socket that may be closed
        if (identity.certificate.empty()) return;
        BIO* in = BIO_new_mem_buf(identity.certificate.data(), -1);
        X509* const certificate = PEM_read_bio_X509(in, nullptr, nullptr, nullptr);
        SSL_CTX_use_certificate(context_, certificate);
        X509_free(certificate);
        BIO_free(in);
        in = BIO_new_mem_buf(identity.key.data(), -1);
        EVP_PKEY* const key = PEM_read_bio_PrivateKey(in, nullptr, nullptr, nullptr);
        SSL_CTX_use_PrivateKey(context_, key);
        EVP_PKEY_free(key);
        BIO_free(in);
    }
    ~TestClient() {
        SSL_free(ssl_);
        SSL_CTX_free(context_);
    }
    TestClient(const TestClient&) = delete;
    TestClient& operator=(const TestClient&) = delete;

    SSL_CTX* context() { return context_; }
    SSL* ssl() { return ssl_; }
    /// True once the handshake is done, as far as the client can tell.
    bool connect(int socket) {
        ssl_ = SSL_new(context_);
        SSL_set_fd(ssl_, socket);
        return SSL_connect(ssl_) == 1;
    }
    bool write(const std::string& text) {
        return SSL_write(ssl_, text.data(), static_cast<int>(text.size())) > 0;
    }
    /// "" where the connection has ended.
    std::string read() {
        char bytes[4096];
        const int size = SSL_read(ssl_, bytes, sizeof bytes);
        return size > 0 ? std::string(bytes, static_cast<std::size_t>(size)) : "";
    }

  private:
    SSL_CTX* context_;
    SSL* ssl_ = nullptr;
};

/// Two connected sockets.
struct Sockets {
    explicit Sockets(boost::asio::io_context& io) : server(io), client(io) {
        using boost::asio::ip::tcp;
        tcp::acceptor acceptor(io, {boost::asio::ip::make_address("127.0.0.1"), 0});
        client.connect(acceptor.local_endpoint());
        acceptor.accept(server);
    }
    boost::asio::ip::tcp::socket server;
    boost::asio::ip::tcp::socket client;
};

}  // namespace panelgate::tls
