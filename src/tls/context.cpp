#include "panelgate/tls/context.hpp"

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509_vfy.h>
#include <algorithm>
#include <limits>
#include <string_view>

#include "native.hpp"

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
constexpr const char* kSystemTrust = "/etc/ssl/certs";

std::shared_ptr<SSL_CTX> new_context(const SSL_METHOD* side, Version lowest) {
    ERR_clear_error();
    const std::shared_ptr<SSL_CTX> made(SSL_CTX_new(side), SSL_CTX_free);
    if (!made) throw Unusable("certificate", "OpenSSL has no memory");
    SSL_CTX_set_min_proto_version(made.get(),
                                  lowest == Version::tls13 ? TLS1_3_VERSION : TLS1_2_VERSION);
    return made;
}

/// Each connection proves its certificate anew: a resumed connection would outlive a revocation,
/// and could have another certificate's role.
void restrict_to_what_is_meant(SSL_CTX* context) {
    SSL_CTX_set_cipher_list(context, kSuites12);
    SSL_CTX_set_ciphersuites(context, kSuites13);
    SSL_CTX_set1_groups_list(context, kGroups);
    SSL_CTX_set_options(context, SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION |
                                     SSL_OP_CIPHER_SERVER_PREFERENCE | SSL_OP_NO_TICKET);
    SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);
    SSL_CTX_set_num_tickets(context, 0);
}

[[noreturn]] void refuse(const char* key, const std::string& file, bool damaged,
                         const std::string& otherwise) {
    ERR_clear_error();
    throw Unusable(key, file + (damaged ? " is damaged or cut off: not all that it holds can be "
                                          "read; copy it again, and under its name in one step (mv)"
                                        : otherwise));
}

/// Takes certificate and key of the settings into use; returns the first end of a certificate.
std::int64_t use_pair(SSL_CTX* context, const Settings& settings) {
    bool damaged = false;
    const auto chain = certificates_of(settings.material.certificate, &damaged);
    if (damaged || chain.empty())
        refuse("certificate", settings.certificate, damaged,
               " holds no certificate; give a file in PEM form (-----BEGIN CERTIFICATE-----)");
    if (SSL_CTX_use_certificate(context, chain.front().get()) != 1)
        refuse("certificate", settings.certificate, false,
               " holds a certificate that TLS does not take; make one with ECDSA P-256, or RSA of "
               "2048 bits or more, and SHA-256");
    for (std::size_t i = 1; i < chain.size(); ++i) SSL_CTX_add1_chain_cert(context, chain[i].get());
    const Owned<EVP_PKEY> key = key_of(settings.material.key);
    if (!key)
        refuse("key", settings.key, false,
               " holds no private key that can be read; give a file in PEM form (-----BEGIN "
               "PRIVATE KEY-----), without a password");
    if (X509_check_private_key(chain.front().get(), key.get()) != 1 ||
        SSL_CTX_use_PrivateKey(context, key.get()) != 1)
        refuse("key", "the key in " + settings.key, false,
               " does not belong to the certificate in " + settings.certificate +
                   "; give the key that it was made with");
    std::int64_t end = std::numeric_limits<std::int64_t>::max();
    for (const auto& one : chain) end = std::min(end, seconds_of(X509_get0_notAfter(one.get())));
    return end;
}

void trust(SSL_CTX* context, const Settings& settings, bool is_server) {
    bool damaged = false;
    const auto trusted = certificates_of(settings.material.ca, &damaged);
    if (damaged || trusted.empty())
        refuse("ca", settings.ca, damaged,
               is_server ? " holds no certificate; give the certificate of the CA that signs those "
                           "of clients, in PEM form"
                         : " holds no certificate; give that of the CA that signs the server's, in "
                           "PEM form");
    for (const auto& one : trusted) {
        X509_STORE_add_cert(SSL_CTX_get_cert_store(context), one.get());
        // A browser chooses its certificate by the names of the CAs.
        if (is_server) SSL_CTX_add_client_CA(context, one.get());
    }
}

void use_lists(SSL_CTX* context, const Settings& settings) {
    bool damaged = false;
    const auto lists = lists_of(settings.material.crl, &damaged);
    if (damaged || lists.empty())
        refuse("crl", settings.crl, damaged,
               " holds no list of revoked certificates; give a file in PEM form (-----BEGIN X509 "
               "CRL-----)");
    X509_STORE* const store = SSL_CTX_get_cert_store(context);
    for (const auto& list : lists) X509_STORE_add_crl(store, list.get());
    X509_STORE_set_flags(store, X509_V_FLAG_CRL_CHECK | X509_V_FLAG_CRL_CHECK_ALL);
}

int verify_mode(ClientCertificate client) {
    if (client == ClientCertificate::none) return SSL_VERIFY_NONE;
    return client == ClientCertificate::optional
               ? SSL_VERIFY_PEER
               : SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT;
}

std::string sentence_of(X509_STORE_CTX* judging) {
    const X509* const own = X509_STORE_CTX_get0_cert(judging);
    const int why = X509_STORE_CTX_get_error(judging);
    const std::string whose = "its certificate " + subject_of(own) + ' ';
    if (why == X509_V_ERR_HOSTNAME_MISMATCH || why == X509_V_ERR_IP_ADDRESS_MISMATCH)
        return whose + "is not of the name by which it is asked";
    if (why == X509_V_ERR_INVALID_PURPOSE) return whose + "is not one of a server";
    return whose + words_of_chain(why);
}

/// Leaves the first fault of a server's chain where SSL_CTX_set_app_data() says.
int judge_server(int good, X509_STORE_CTX* judging) {
    if (good != 0) return good;
    const auto* const ssl = static_cast<const SSL*>(
        X509_STORE_CTX_get_ex_data(judging, SSL_get_ex_data_X509_STORE_CTX_idx()));
    auto* const refusal = static_cast<std::string*>(SSL_CTX_get_app_data(SSL_get_SSL_CTX(ssl)));
    if (refusal->empty()) *refusal = sentence_of(judging);
    return 0;
}

}  // namespace

Context::Context(const Settings& settings)
    : context_(new_context(TLS_server_method(), settings.lowest)) {
    restrict_to_what_is_meant(context_.get());
    expiry_ = use_pair(context_.get(), settings);
    if (!settings.ca.empty()) trust(context_.get(), settings, true);
    if (!settings.crl.empty()) use_lists(context_.get(), settings);
    SSL_CTX_set_verify(context_.get(), verify_mode(settings.client), nullptr);
    ERR_clear_error();
}

bool Context::revokes(x509_st* certificate) const {
    const STACK_OF(X509_OBJECT)* const all =
        X509_STORE_get0_objects(SSL_CTX_get_cert_store(context_.get()));
    for (int i = 0; i < sk_X509_OBJECT_num(all); ++i) {
        X509_CRL* const list = X509_OBJECT_get0_X509_CRL(sk_X509_OBJECT_value(all, i));
        X509_REVOKED* entry = nullptr;
        if (list != nullptr &&
            X509_NAME_cmp(X509_CRL_get_issuer(list), X509_get_issuer_name(certificate)) == 0 &&
            X509_CRL_get0_by_cert(list, &entry, certificate) == 1)
            return true;
    }
    return false;
}

ClientContext::ClientContext(const Settings& settings, const std::string& server)
    : context_(new_context(TLS_client_method(), Version::tls12)) {
    SSL_CTX* const context = context_.get();
    SSL_CTX_set_mode(context, SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
    if (settings.ca.empty())
        SSL_CTX_load_verify_dir(context, kSystemTrust);
    else
        trust(context, settings, false);
    if (!settings.certificate.empty()) use_pair(context, settings);
    expect_peer(SSL_CTX_get0_param(context), server);
    SSL_CTX_set_app_data(context, &refusal_);
    SSL_CTX_set_verify(context, SSL_VERIFY_PEER, judge_server);
    ERR_clear_error();
}

}  // namespace panelgate::tls
