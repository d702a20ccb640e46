#include "engine.hpp"

#include <openssl/err.h>
#include <openssl/x509_vfy.h>
#include <sys/socket.h>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "proof.hpp"

namespace panelgate::tls {

/// The BIO of an engine.
struct Wire {
    static Engine* engine(BIO* bio) { return static_cast<Engine*>(BIO_get_data(bio)); }
    static int read(BIO* bio, char* into, int size) {
        BIO_clear_retry_flags(bio);
        const int got = engine(bio)->read(into, size);
        if (got == -1) BIO_set_retry_read(bio);
        return got == -2 ? -1 : got;
    }
    static int write(BIO* bio, const char* bytes, int size) {
        BIO_clear_retry_flags(bio);
        const int sent = engine(bio)->write(bytes, size);
        if (sent == -1) BIO_set_retry_write(bio);
        return sent == -2 ? -1 : sent;
    }
    static long control(BIO* bio, int what, long, void*) {
        if (what == BIO_CTRL_FLUSH) return 1;
        return what == BIO_CTRL_EOF && engine(bio)->ended_ ? 1 : 0;
    }
    static int create(BIO* bio) {
        BIO_set_init(bio, 1);
        return 1;
    }
    static const BIO_METHOD* method() {
        static const BIO_METHOD* const kMethod = [] {
            BIO_METHOD* made = BIO_meth_new(BIO_get_new_index() | BIO_TYPE_SOURCE_SINK, "engine");
            BIO_meth_set_read(made, read);
            BIO_meth_set_write(made, write);
            BIO_meth_set_ctrl(made, control);
            BIO_meth_set_create(made, create);
            return made;
        }();
        return kMethod;
    }
};

namespace {

bool is_passing(int why) { return why == EAGAIN || why == EWOULDBLOCK || why == EINTR; }

}  // namespace

/// -1: not now; -2: never.
int Engine::read(char* into, int size) {
    if (taken < input.size()) {
        const std::size_t given = std::min(static_cast<std::size_t>(size), input.size() - taken);
        std::memcpy(into, input.data() + taken, given);
        taken += given;
        if (taken == input.size()) {
            input = std::string();
            taken = 0;
        }
        return static_cast<int>(given);
    }
    if (ahead_taken_ < ahead_size_) {
        const std::size_t given =
            std::min(static_cast<std::size_t>(size), ahead_size_ - ahead_taken_);
        std::memcpy(into, ahead_.data() + ahead_taken_, given);
        ahead_taken_ += given;
        return static_cast<int>(given);
    }
    if (socket_ < 0) return -1;
    const auto got = ::recv(socket_, into, static_cast<std::size_t>(size), MSG_DONTWAIT);
    if (got < 0) return is_passing(errno) ? -1 : -2;
    ended_ = got == 0;
    return static_cast<int>(got);
}

int Engine::write(const char* bytes, int size) {
    if (socket_ < 0) {
        output.append(bytes, static_cast<std::size_t>(size));
        return size;
    }
    const auto sent =
        ::send(socket_, bytes, static_cast<std::size_t>(size), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent < 0) return is_passing(errno) ? -1 : -2;
    return static_cast<int>(sent);
}

bool Engine::holds_input() const {
    return taken < input.size() || ahead_taken_ < ahead_size_ || SSL_has_pending(ssl_.get()) == 1;
}

void Engine::create(SSL_CTX* context) {
    ssl_.reset(SSL_new(context));
    BIO* const bio = BIO_new(Wire::method());
    BIO_set_data(bio, this);
    SSL_set_bio(ssl_.get(), bio, bio);
    SSL_set_app_data(ssl_.get(), &refused_);
}

Engine::Engine(const std::shared_ptr<SSL_CTX>& context) {
    create(context.get());
    SSL_set_connect_state(ssl_.get());
}

Engine::Progress Engine::handshake() {
    if (!ssl_) {
        create(context_->native());
        SSL_set_accept_state(ssl_.get());
    }
    ERR_clear_error();
    const int result = SSL_do_handshake(ssl_.get());
    if (result == 1) {
        outcome_ = Outcome::done;
        return Progress::done;
    }
    const int code = SSL_get_error(ssl_.get(), result);
    if (code == SSL_ERROR_WANT_READ) return Progress::needs_input;
    explain(ERR_GET_REASON(ERR_peek_error()));
    ERR_clear_error();
    return Progress::failed;
}

namespace {

struct Explained {
    int reason;
    Outcome outcome;
    const char* text;
};

constexpr const char* kNotTaken =
    "the client does not take the gateway's certificate; give the client the certificate of the CA "
    "that signed it";
constexpr const char* kNoneShown =
    "the client shows no certificate; give it one that the CA of `ca` signed";
constexpr const char* kVersions =
    "the client speaks no version that is allowed: TLS 1.3, and TLS 1.2 with AEAD suites unless "
    "`min_version` rules it out";

constexpr Explained kExplained[] = {
    {SSL_R_PEER_DID_NOT_RETURN_A_CERTIFICATE, Outcome::no_certificate, kNoneShown},
    {SSL_R_UNSUPPORTED_PROTOCOL, Outcome::version, kVersions},
    {SSL_R_NO_SHARED_CIPHER, Outcome::version,
     "the client offers no cipher suite that is allowed; ECDHE with AES-GCM or ChaCha20 is"},
    {SSL_R_VERSION_TOO_LOW, Outcome::version, kVersions},
    {SSL_R_WRONG_VERSION_NUMBER, Outcome::broken, "the client's bytes are no TLS"},
    {SSL_R_TLSV1_ALERT_UNKNOWN_CA, Outcome::refused, kNotTaken},
    {SSL_R_SSLV3_ALERT_BAD_CERTIFICATE, Outcome::refused, kNotTaken},
    {SSL_R_SSLV3_ALERT_CERTIFICATE_UNKNOWN, Outcome::refused, kNotTaken},
    {SSL_R_SSLV3_ALERT_UNSUPPORTED_CERTIFICATE, Outcome::refused,
     "the client says that the gateway's certificate is of a kind that it does not take; is it one "
     "of a server?"},
    {SSL_R_SSLV3_ALERT_CERTIFICATE_REVOKED, Outcome::refused,
     "the client says that the gateway's certificate is revoked"},
    {SSL_R_TLSV1_ALERT_ACCESS_DENIED, Outcome::refused, "the client ended it"},
    {SSL_R_SSLV3_ALERT_CERTIFICATE_EXPIRED, Outcome::refused,
     "the client says that the gateway's certificate has expired"},
    {SSL_R_SSLV3_ALERT_HANDSHAKE_FAILURE, Outcome::refused, "the client ended it"},
    {SSL_R_TLSV1_ALERT_PROTOCOL_VERSION, Outcome::version, kVersions},
};

}  // namespace

void Engine::explain(int reason) {
    const long chain = SSL_get_verify_result(ssl_.get());
    if (chain != X509_V_OK) return explain_chain(chain);
    const auto* const found = std::ranges::find(kExplained, reason, &Explained::reason);
    if (found != std::end(kExplained)) {
        outcome_ = found->outcome;
        why_ = found->text;
        return;
    }
    outcome_ = Outcome::broken;
    const unsigned long code = ERR_peek_error();
    const char* const text = code == 0 ? nullptr : ERR_reason_error_string(code);
    why_ = text == nullptr ? "the handshake was cut off" : text;
}

void Engine::explain_chain(long result) {
    Refusal refusal = refusal_of(result, refused_);
    outcome_ = refusal.outcome;
    why_ = std::move(refusal.why);
}

}  // namespace panelgate::tls
