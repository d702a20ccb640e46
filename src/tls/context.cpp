#include "panelgate/tls/context.hpp"

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509_vfy.h>
#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

#include "native.hpp"
#include "own_pair.hpp"
#include "proof.hpp"

namespace panelgate::tls {
namespace {

// Forward secrecy and authenticated encryption only (RFC 9325; Modbus/TCP Security asks for
// ECDHE_ECDSA_AES_128_GCM and ECDHE_RSA_AES_128_GCM).
constexpr const char* kSuites12 =
    "ECDHE-ECDSA-AES128-GCM-SHA256:ECDHE-RSA-AES128-GCM-SHA256:"
    "ECDHE-ECDSA-AES256-GCM-SHA384:ECDHE-RSA-AES256-GCM-SHA384:"
    "ECDHE-ECDSA-CHACHA20-POLY1305:ECDHE-RSA-CHACHA20-POLY1305";
constexpr const char* kSuites13 =
    "TLS_AES_128_GCM_SHA256:TLS_AES_256_GCM_SHA384:TLS_CHACHA20_POLY1305_SHA256";
constexpr const char* kGroups = "X25519:P-256:P-384";

/// A list that is overdue still says who is revoked: its age locks nobody out. Leaves for the
/// log whose certificate is refused, where SSL_set_app_data() says.
int judge_chain(int good, X509_STORE_CTX* chain) {
    if (good != 0) return good;
    const int why = X509_STORE_CTX_get_error(chain);
    if (why == X509_V_ERR_CRL_HAS_EXPIRED) {
        X509_STORE_CTX_set_error(chain, X509_V_OK);
        return 1;
    }
    const auto* const ssl = static_cast<const SSL*>(
        X509_STORE_CTX_get_ex_data(chain, SSL_get_ex_data_X509_STORE_CTX_idx()));
    if (ssl == nullptr) return 0;  // not in a handshake
    auto* const refused = static_cast<std::string*>(SSL_get_app_data(ssl));
    if (refused != nullptr) *refused = blamed(chain);
    return 0;
}

/// CAs may have the same name: only those lists count that the CA in the chain has signed.
STACK_OF(X509_CRL) * lists_of_ca(const X509_STORE_CTX* judging, const X509_NAME* name) {
    STACK_OF(X509_CRL)* const found = X509_STORE_CTX_get1_crls(judging, name);
    const STACK_OF(X509)* const chain = X509_STORE_CTX_get0_chain(judging);
    const int depth = X509_STORE_CTX_get_error_depth(judging);
    const X509* const ca = sk_X509_value(chain, std::min(depth + 1, sk_X509_num(chain) - 1));
    for (int i = sk_X509_CRL_num(found) - 1; ca != nullptr && i >= 0; --i) {
        if (X509_CRL_verify(sk_X509_CRL_value(found, i), X509_get0_pubkey(ca)) == 1) continue;
        X509_CRL_free(sk_X509_CRL_delete(found, i));
    }
    ERR_clear_error();
    return found;
}

void set_common(SSL_CTX* context, const Settings& settings) {
    SSL_CTX_set_min_proto_version(
        context, settings.lowest == Version::tls13 ? TLS1_3_VERSION : TLS1_2_VERSION);
    SSL_CTX_set_cipher_list(context, kSuites12);
    SSL_CTX_set_ciphersuites(context, kSuites13);
    SSL_CTX_set1_groups_list(context, kGroups);
    // A connection that ends without close_notify loses nothing: lengths end ADUs and requests.
    SSL_CTX_set_options(context, SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION |
                                     SSL_OP_CIPHER_SERVER_PREFERENCE | SSL_OP_NO_TICKET |
                                     SSL_OP_IGNORE_UNEXPECTED_EOF);
    // Each connection proves its certificate anew: a resumed one would outlive a revocation, and
    // could have another's role.
    SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);
    SSL_CTX_set_num_tickets(context, 0);
    SSL_CTX_set_mode(context, SSL_MODE_RELEASE_BUFFERS | SSL_MODE_ENABLE_PARTIAL_WRITE |
                                  SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
    SSL_CTX_set_read_ahead(context, 1);
}

int verify_mode(ClientCertificate client) {
    switch (client) {
        case ClientCertificate::none:
            return SSL_VERIFY_NONE;
        case ClientCertificate::optional:
            return SSL_VERIFY_PEER;
        case ClientCertificate::required:
            return SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT;
    }
    std::abort();
}

}  // namespace

Context::Context(const Settings& settings)
    : context_(SSL_CTX_new(TLS_server_method()), SSL_CTX_free), client_(settings.client) {
    if (!context_) throw Unusable("certificate", "OpenSSL has no memory");
    ERR_clear_error();
    set_common(context_.get(), settings);
    expiry_ = use_pair(context_.get(), settings);
    use_ca(settings);
    use_crl(settings);
    SSL_CTX_set_verify(context_.get(), verify_mode(settings.client), judge_chain);
}

/// Browsers choose among their certificates by the names that are sent to them.
void Context::use_ca(const Settings& settings) {
    if (settings.ca.empty()) return;
    const auto trusted = trusted_authorities(
        settings, "the certificate of the CA that signs those of clients, in PEM form");
    X509_STORE* const store = SSL_CTX_get_cert_store(context_.get());
    for (const auto& one : trusted) {
        X509_STORE_add_cert(store, one.get());
        SSL_CTX_add_client_CA(context_.get(), one.get());
    }
}

/// Those between a client and its CA are looked up where the CAs' lists are all there.
void Context::use_crl(const Settings& settings) {
    if (settings.crl.empty()) return;
    const auto lists = lists_of(settings.material.crl);
    if (lists.empty())
        throw Unusable("crl", settings.crl +
                                  " holds no list of revoked certificates; give a file in PEM form "
                                  "(-----BEGIN X509 CRL-----)");
    check_whole("crl", settings.crl, settings.material.crl, "CRL", lists.size());
    X509_STORE* const store = SSL_CTX_get_cert_store(context_.get());
    for (const auto& list : lists) X509_STORE_add_crl(store, list.get());
    unsigned long flags = X509_V_FLAG_CRL_CHECK;
    if (without_list(certificates_of(settings.material.ca), lists).empty())
        flags |= X509_V_FLAG_CRL_CHECK_ALL;
    X509_STORE_set_flags(store, flags);
    X509_STORE_set_lookup_crls(store, lists_of_ca);
}

}  // namespace panelgate::tls
