#pragma once

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/tls/counters.hpp"

namespace panelgate::tls {

/// Frees OpenSSL's objects.
struct Free {
    void operator()(BIO* bio) const { BIO_free_all(bio); }
    void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
    void operator()(X509* certificate) const { X509_free(certificate); }
    void operator()(X509_CRL* list) const { X509_CRL_free(list); }
};
template <class T>
using Owned = std::unique_ptr<T, Free>;

/// Returns the certificates of a PEM text, in order; other objects are skipped. `damaged`, where
/// given, becomes true for a text that ends within an object.
std::vector<Owned<X509>> certificates_of(std::string_view pem, bool* damaged = nullptr);
/// The same of lists of revoked certificates.
std::vector<Owned<X509_CRL>> lists_of(std::string_view pem, bool* damaged = nullptr);
/// Returns the key of a PEM text; null if there is none, or a password would be needed.
Owned<EVP_PKEY> key_of(std::string_view pem);

/// Wants the other side's certificate to be of this address or name. True for a name.
bool expect_peer(X509_VERIFY_PARAM* verification, const std::string& server);

/// Returns a time in seconds since 1970.
std::int64_t seconds_of(const ASN1_TIME* time);
/// "CN=panel PC 3,O=Plant" as a line of a log may show it: at most 200 bytes, no control character.
std::string name_text(const X509_NAME* name);
std::string subject_of(const X509* certificate);

/// Why a client is not let in.
struct Refusal {
    Outcome outcome = Outcome::broken;
    std::string why;
};
/// Says what a verification (X509_V_ERR_*) found wrong with a certificate: "has expired".
std::string words_of_chain(int result);
Outcome outcome_of_chain(int result);

}  // namespace panelgate::tls
