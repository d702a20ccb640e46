#include "proof.hpp"

#include <openssl/err.h>
#include <openssl/x509_vfy.h>

namespace panelgate::tls {
namespace {

Owned<X509> kept(X509* certificate) {
    if (certificate != nullptr) X509_up_ref(certificate);
    return Owned<X509>(certificate);
}

Outcome outcome_of_chain(long result) {
    switch (result) {
        case X509_V_ERR_CERT_HAS_EXPIRED:
        case X509_V_ERR_CERT_NOT_YET_VALID:
            return Outcome::expired;
        case X509_V_ERR_CERT_REVOKED:
            return Outcome::revoked;
        default:
            return Outcome::untrusted;
    }
}

}  // namespace

std::string words_of_chain(long result) {
    switch (result) {
        case X509_V_ERR_CERT_HAS_EXPIRED:
            return "has expired";
        case X509_V_ERR_CERT_NOT_YET_VALID:
            return "is not valid yet; compare the clocks";
        case X509_V_ERR_CERT_REVOKED:
            return "is revoked";
        case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT_LOCALLY:
        case X509_V_ERR_UNABLE_TO_VERIFY_LEAF_SIGNATURE:
        case X509_V_ERR_DEPTH_ZERO_SELF_SIGNED_CERT:
        case X509_V_ERR_SELF_SIGNED_CERT_IN_CHAIN:
            return "is not signed by the CA of `ca`";
        case X509_V_ERR_INVALID_PURPOSE:
            return "is not one of a client; its extended key usage must have clientAuth, and its "
                   "key "
                   "usage, if it has one, digitalSignature";
        case X509_V_ERR_UNABLE_TO_GET_CRL:
            return "is of a CA whose list of revoked certificates is not in `crl`";
        default:
            return std::string("cannot be trusted: ") + X509_verify_cert_error_string(result);
    }
}

std::string blamed(X509_STORE_CTX* judging) {
    const X509* const own = X509_STORE_CTX_get0_cert(judging);
    const X509* const judged = X509_STORE_CTX_get_current_cert(judging);
    const std::string client = "the client's certificate " + subject_of(own);
    if (judged == nullptr || X509_cmp(judged, own) == 0) return client;
    return "the CA " + subject_of(judged) + " of " + client;
}

Refusal refusal_of(long result, const std::string& blamed) {
    return {outcome_of_chain(result), blamed + ' ' + words_of_chain(result)};
}

Proof::Proof(SSL* connection)
    : version_(SSL_version(connection)), certificate_(kept(SSL_get0_peer_certificate(connection))) {
    const STACK_OF(X509)* const others = SSL_get_peer_cert_chain(connection);
    for (int i = 0; others != nullptr && i < sk_X509_num(others); ++i)
        others_.push_back(kept(sk_X509_value(others, i)));
}

std::optional<Refusal> Proof::refusal_by(const Context& context) const {
    if (version_ < SSL_CTX_get_min_proto_version(context.native()))
        return Refusal{Outcome::version, "its version of TLS is not allowed any more"};
    if (context.client() == ClientCertificate::none) return std::nullopt;
    if (certificate_) return judge_chain(context);
    if (context.client() == ClientCertificate::optional) return std::nullopt;
    return Refusal{Outcome::no_certificate, "the client has shown no certificate, and now must"};
}

/// As SSL_do_handshake() does.
std::optional<Refusal> Proof::judge_chain(const Context& context) const {
    SSL_CTX* const rules = context.native();
    const Owned<STACK_OF(X509)> between(sk_X509_new_null());
    for (const auto& one : others_) sk_X509_push(between.get(), one.get());
    const Owned<X509_STORE_CTX> judging(X509_STORE_CTX_new());
    X509_STORE_CTX_init(judging.get(), SSL_CTX_get_cert_store(rules), certificate_.get(),
                        between.get());
    X509_STORE_CTX_set_default(judging.get(), "ssl_client");
    X509_VERIFY_PARAM_set_auth_level(X509_STORE_CTX_get0_param(judging.get()),
                                     SSL_CTX_get_security_level(rules));
    X509_STORE_CTX_set_verify_cb(judging.get(), SSL_CTX_get_verify_callback(rules));
    const bool good = X509_verify_cert(judging.get()) == 1;
    const int why = X509_STORE_CTX_get_error(judging.get());
    ERR_clear_error();
    if (good) return std::nullopt;
    return refusal_of(why, blamed(judging.get()));
}

}  // namespace panelgate::tls
