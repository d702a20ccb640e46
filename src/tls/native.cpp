#include "native.hpp"

#include <openssl/asn1.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509_vfy.h>
#include <algorithm>
#include <array>
#include <ctime>

#include "panelgate/base/text.hpp"

namespace panelgate::tls {
namespace {

constexpr std::size_t kLongestName = 200;
/// Characters that end a line, or turn the rest of the line round, where a log is shown.
constexpr std::array<std::string_view, 13> kTurnsLines{
    "\u0085", "\u2028", "\u2029", "\u200e", "\u200f", "\u202a", "\u202b",
    "\u202c", "\u202d", "\u202e", "\u2066", "\u2067", "\u2069"};

/// Nobody is asked for a password.
int no_password(char*, int, int, void*) { return 0; }

template <class T, class Read>
std::vector<Owned<T>> all_of(std::string_view pem, bool* damaged, Read read) {
    std::vector<Owned<T>> found;
    const Owned<BIO> in(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())));
    ERR_clear_error();
    while (T* one = read(in.get(), nullptr, no_password, nullptr)) found.emplace_back(one);
    if (damaged != nullptr) *damaged = ERR_GET_REASON(ERR_peek_last_error()) != PEM_R_NO_START_LINE;
    ERR_clear_error();
    return found;
}

}  // namespace

std::vector<Owned<X509>> certificates_of(std::string_view pem, bool* damaged) {
    return all_of<X509>(pem, damaged, PEM_read_bio_X509);
}

std::vector<Owned<X509_CRL>> lists_of(std::string_view pem, bool* damaged) {
    return all_of<X509_CRL>(pem, damaged, PEM_read_bio_X509_CRL);
}

Owned<EVP_PKEY> key_of(std::string_view pem) {
    const Owned<BIO> in(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())));
    Owned<EVP_PKEY> key(PEM_read_bio_PrivateKey(in.get(), nullptr, no_password, nullptr));
    ERR_clear_error();
    return key;
}

bool expect_peer(X509_VERIFY_PARAM* verification, const std::string& server) {
    if (X509_VERIFY_PARAM_set1_ip_asc(verification, server.c_str()) == 1) return false;
    X509_VERIFY_PARAM_set1_host(verification, server.data(), server.size());
    return true;
}

std::int64_t seconds_of(const ASN1_TIME* time) {
    std::tm parts{};
    return ASN1_TIME_to_tm(time, &parts) == 1 ? ::timegm(&parts) : 0;
}

std::string name_text(const X509_NAME* name) {
    const Owned<BIO> out(BIO_new(BIO_s_mem()));
    X509_NAME_print_ex(out.get(), name, 0,
                       XN_FLAG_RFC2253 & ~static_cast<unsigned long>(ASN1_STRFLGS_ESC_MSB));
    char* text = nullptr;
    const long size = BIO_get_mem_data(out.get(), &text);
    std::string subject(text, static_cast<std::size_t>(std::max(size, 0L)));
    if (subject.size() > kLongestName) subject.resize(kLongestName);
    std::ranges::replace_if(subject, is_control, '?');
    for (const std::string_view one : kTurnsLines)
        for (std::size_t at = subject.find(one); at != subject.npos; at = subject.find(one))
            subject.replace(at, one.size(), "?");
    return subject;
}

std::string subject_of(const X509* certificate) {
    return name_text(X509_get_subject_name(certificate));
}

Outcome outcome_of_chain(int result) {
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

std::string words_of_chain(int result) {
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
        case X509_V_ERR_UNABLE_TO_GET_CRL:
            return "is of a CA whose list of revoked certificates is not in `crl`";
        default:
            return std::string("cannot be trusted: ") + X509_verify_cert_error_string(result);
    }
}

}  // namespace panelgate::tls
