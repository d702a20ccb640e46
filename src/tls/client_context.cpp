#include "panelgate/tls/client_context.hpp"

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509_vfy.h>
#include <openssl/x509v3.h>
#include <cstddef>

#include "native.hpp"
#include "own_pair.hpp"
#include "panelgate/tls/context.hpp"
#include "proof.hpp"

namespace panelgate::tls {
namespace {

constexpr const char* kSystemTrust = "/etc/ssl/certs";

std::string sentence_of(X509_STORE_CTX* judging) {
    const X509* const own = X509_STORE_CTX_get0_cert(judging);
    const int why = X509_STORE_CTX_get_error(judging);
    const std::string whose = "its certificate " + subject_of(own) + ' ';
    switch (why) {
        case X509_V_ERR_HOSTNAME_MISMATCH:
        case X509_V_ERR_IP_ADDRESS_MISMATCH:
            return whose + "is not of the name by which it is asked";
        case X509_V_ERR_INVALID_PURPOSE:
            return whose + "is not one of a server";
        default:
            return whose + words_of_chain(why);
    }
}

int judge_server(int good, X509_STORE_CTX* judging) {
    if (good != 0) return good;
    const auto* const ssl = static_cast<const SSL*>(
        X509_STORE_CTX_get_ex_data(judging, SSL_get_ex_data_X509_STORE_CTX_idx()));
    auto* const refusal = static_cast<std::string*>(SSL_CTX_get_app_data(SSL_get_SSL_CTX(ssl)));
    if (refusal->empty()) *refusal = sentence_of(judging);
    return 0;
}

void trust(SSL_CTX* context, const Settings& settings) {
    if (settings.ca.empty()) {
        SSL_CTX_load_verify_dir(context, kSystemTrust);
        return;
    }
    const auto trusted =
        trusted_authorities(settings, "that of the CA that signs the server's, in PEM form");
    for (const auto& one : trusted) X509_STORE_add_cert(SSL_CTX_get_cert_store(context), one.get());
}

}  // namespace

ClientContext::ClientContext(const Settings& settings, const std::string& server)
    : context_(SSL_CTX_new(TLS_client_method()), SSL_CTX_free) {
    ERR_clear_error();
    SSL_CTX* const context = context_.get();
    SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION);
    SSL_CTX_set_mode(context, SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
    trust(context, settings);
    if (!settings.certificate.empty()) use_pair(context, settings);
    expect_peer(SSL_CTX_get0_param(context), server);
    ERR_clear_error();
    SSL_CTX_set_app_data(context, &refusal_);
    SSL_CTX_set_verify(context, SSL_VERIFY_PEER, judge_server);
}

}  // namespace panelgate::tls
