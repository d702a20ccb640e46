#pragma once

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace panelgate::tls {

/// Frees OpenSSL's objects.
struct Free {
    void operator()(BIO* bio) const { BIO_free_all(bio); }
    void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
    void operator()(X509* certificate) const { X509_free(certificate); }
    void operator()(X509_CRL* list) const { X509_CRL_free(list); }
    void operator()(SSL* ssl) const { SSL_free(ssl); }
    void operator()(X509_STORE* store) const { X509_STORE_free(store); }
    void operator()(X509_STORE_CTX* judging) const { X509_STORE_CTX_free(judging); }
    /// Not what is in it.
    void operator()(STACK_OF(X509) * stack) const { sk_X509_free(stack); }
};
template <class T>
using Owned = std::unique_ptr<T, Free>;

/// A view of text; it must outlive the result.
Owned<BIO> reader_of(std::string_view text);
/// All certificates of a PEM text, in order; what is none is skipped.
std::vector<Owned<X509>> certificates_of(std::string_view pem);
std::vector<Owned<X509_CRL>> lists_of(std::string_view pem);
/// Those CAs that have signed none of the lists.
std::vector<X509*> without_list(const std::vector<Owned<X509>>& authorities,
                                const std::vector<Owned<X509_CRL>>& lists);
/// CAs may have the same name, but not the same key.
bool has_signed(const X509* authority, X509_CRL* list);
/// Wants the other side's certificate to be of this address or name. True if it is a name.
bool expect_peer(X509_VERIFY_PARAM* verification, const std::string& server);
/// Null if there is none, or it is encrypted: nobody is asked for a password.
Owned<EVP_PKEY> key_of(std::string_view pem);
/// Seconds since 1970.
std::int64_t seconds_of(const ASN1_TIME* time);
std::string name_text(const X509_NAME* name);
std::string subject_of(const X509* certificate);
/// True if all of a PEM text could be read, which holds `read` objects of a kind ("CERTIFICATE"):
/// false for one that is cut off or damaged.
bool is_whole(std::string_view pem, std::string_view kind, std::size_t read);

}  // namespace panelgate::tls
