#include "panelgate/tls/issue.hpp"

#include <openssl/bn.h>
#include <openssl/ec.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>
#include <algorithm>
#include <limits>
#include <memory>
#include <regex>
#include <utility>

#include "native.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/tls/peer.hpp"

namespace panelgate::tls {
namespace {

constexpr std::int64_t kHour = 3600;
constexpr std::int64_t kDay = 24 * kHour;
constexpr std::size_t kLongestSubject = 64;  // X.520, ub-common-name

template <class Write>
std::string pem_of(Write write) {
    const Owned<BIO> out(BIO_new(BIO_s_mem()));
    char* text = nullptr;
    if (write(out.get()) != 1) throw CannotIssue("OpenSSL cannot write what it has made");
    const long size = BIO_get_mem_data(out.get(), &text);
    return {text, static_cast<std::size_t>(std::max(size, 0L))};
}

/// A CA that may sign.
struct Signer {
    std::vector<Owned<X509>> chain;
    Owned<EVP_PKEY> key;

    explicit Signer(const Issued& ca)
        : chain(certificates_of(ca.certificate)), key(key_of(ca.key)) {
        if (chain.empty() || X509_check_ca(certificate()) == 0)
            throw CannotIssue("the CA's file holds no certificate of a CA; make one with new-ca");
        if (!key || X509_check_private_key(certificate(), key.get()) != 1)
            throw CannotIssue("the CA's key does not belong to its certificate, or has a password");
    }
    X509* certificate() const { return chain.front().get(); }
    bool has_signed(const X509_NAME* issuer, int verified) const {
        ERR_clear_error();
        return X509_NAME_cmp(issuer, X509_get_subject_name(certificate())) == 0 && verified == 1;
    }
};

using Extensions = std::vector<std::pair<const char*, std::string>>;

void name_and_date(X509* made, const std::string& name, const Validity& validity,
                   std::int64_t latest) {
    const std::int64_t end =
        std::min(validity.now - kHour + validity.days * kDay - 1, latest);  // both ends count
    if (end <= validity.now)
        throw CannotIssue("the CA's certificate has expired; make a new one with new-ca");
    ASN1_TIME_set(X509_getm_notBefore(made), validity.now - kHour);
    ASN1_TIME_set(X509_getm_notAfter(made), end);
    const auto* const text = reinterpret_cast<const unsigned char*>(name.c_str());
    X509_NAME* const subject = X509_get_subject_name(made);
    if (std::ranges::any_of(name, is_control) ||
        X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_UTF8, text, -1, -1, 0) != 1)
        throw CannotIssue("a name has 1 to 64 characters, of UTF-8, none of control", true);
}

void extend(X509* made, X509* issuer, const Extensions& extensions) {
    X509V3_CTX context;
    X509V3_set_ctx(&context, issuer, made, nullptr, nullptr, 0);
    for (const auto& [kind, value] : extensions) {
        X509_EXTENSION* const one = X509V3_EXT_nconf(nullptr, &context, kind, value.c_str());
        if (one == nullptr) throw CannotIssue(std::string("OpenSSL cannot make ") + kind);
        X509_add_ext(made, one, -1);
        X509_EXTENSION_free(one);
    }
}

/// Signs a certificate with these extensions; `signer` null: by itself.
Issued sign(const std::string& name, const Signer* signer, const Validity& validity,
            const Extensions& extensions) {
    const Owned<X509> made(X509_new());
    const Owned<EVP_PKEY> key(EVP_EC_gen("P-256"));
    X509* const issuer = signer != nullptr ? signer->certificate() : made.get();
    name_and_date(made.get(), name, validity,
                  signer != nullptr ? seconds_of(X509_get0_notAfter(issuer))
                                    : std::numeric_limits<std::int64_t>::max());
    X509_set_version(made.get(), X509_VERSION_3);
    const std::unique_ptr<BIGNUM, decltype(&BN_free)> serial(BN_new(), BN_free);
    BN_rand(serial.get(), 127, BN_RAND_TOP_ONE, BN_RAND_BOTTOM_ANY);
    BN_to_ASN1_INTEGER(serial.get(), X509_get_serialNumber(made.get()));
    X509_set_issuer_name(made.get(), X509_get_subject_name(issuer));
    X509_set_pubkey(made.get(), key.get());
    extend(made.get(), issuer, extensions);
    if (X509_sign(made.get(), signer != nullptr ? signer->key.get() : key.get(), EVP_sha256()) <= 0)
        throw CannotIssue("the CA's key cannot sign");
    return {pem_of([&](BIO* out) { return PEM_write_bio_X509(out, made.get()); }),
            pem_of([&](BIO* out) {
                return PEM_write_bio_PrivateKey(out, key.get(), nullptr, nullptr, 0, nullptr,
                                                nullptr);
            })};
}

bool is_address(const std::string& name) {
    ASN1_OCTET_STRING* const address = a2i_IPADDRESS(name.c_str());
    ASN1_OCTET_STRING_free(address);
    ERR_clear_error();
    return address != nullptr;
}

/// RFC 1123 2.1, RFC 6125 6.4.3: a '*' is the whole first label of three or more. A name whose last
/// label is a number is an address, or none.
bool is_host(const std::string& name) {
    static const std::string kLabel = "[A-Za-z0-9_]([A-Za-z0-9_-]{0,61}[A-Za-z0-9_])?";
    static const std::regex kHost("(?!(.*\\.)?[0-9]+$)(\\*\\.(?=.*\\.))?(" + kLabel + "\\.)*" +
                                  kLabel);
    return name.size() <= 253 && std::regex_match(name, kHost);
}

Extensions end_entity(const char* usage) {
    return {{"basicConstraints", "critical,CA:FALSE"},
            {"keyUsage", "critical,digitalSignature"},
            {"extendedKeyUsage", usage},
            {"subjectKeyIdentifier", "hash"},
            {"authorityKeyIdentifier", "keyid"}};
}

}  // namespace

Issued issue_ca(const std::string& name, const Validity& validity) {
    return sign(name, nullptr, validity,
                {{"basicConstraints", "critical,CA:TRUE,pathlen:0"},
                 {"keyUsage", "critical,keyCertSign,cRLSign"},
                 {"subjectKeyIdentifier", "hash"}});
}

Issued issue_server(const Issued& ca, const std::vector<std::string>& names,
                    const Validity& validity) {
    std::string subject;
    std::string alternatives;
    for (const std::string& name : names) {
        if (!is_address(name) && !is_host(name))
            throw CannotIssue("'" + name + "' is no host name or IP address, such as " +
                                  "gateway.plant.example or 192.168.10.4, without a port or more",
                              true);
        if (subject.empty() && name.size() <= kLongestSubject) subject = name;
        alternatives += (alternatives.empty() ? "" : ",") +
                        std::string(is_address(name) ? "IP:" : "DNS:") + name;
    }
    if (subject.empty() && !names.empty())
        subject = names.front().substr(0, names.front().find('.'));
    auto extensions = end_entity("serverAuth");
    extensions.emplace_back("subjectAltName", alternatives);
    const Signer signer(ca);
    return sign(subject, &signer, validity, extensions);
}

Issued issue_client(const Issued& ca, const std::string& name,
                    const std::optional<std::string>& role, const Validity& validity) {
    auto extensions = end_entity("clientAuth");
    if (role && !is_role_word(*role))
        throw CannotIssue("a role is a word of 1 to 64 bytes of UTF-8, none of control", true);
    if (role)
        extensions.emplace_back(kRoleExtension.data(), "ASN1:FORMAT:UTF8,UTF8String:" + *role);
    const Signer signer(ca);
    return sign(name, &signer, validity, extensions);
}

namespace {

/// Returns the former list, or an empty one of this CA.
Owned<X509_CRL> former_list(const Signer& signer, std::string_view list) {
    auto former = lists_of(list);
    if (!former.empty()) {
        X509_CRL* const own = former.front().get();
        if (!signer.has_signed(X509_CRL_get_issuer(own), X509_CRL_verify(own, signer.key.get())))
            throw CannotIssue("the former list of revoked certificates is another CA's");
        return std::move(former.front());
    }
    if (!list.empty()) throw CannotIssue("the file of revoked certificates holds no list");
    Owned<X509_CRL> made(X509_CRL_new());
    X509_CRL_set_version(made.get(), X509_CRL_VERSION_2);
    X509_CRL_set_issuer_name(made.get(), X509_get_subject_name(signer.certificate()));
    X509V3_CTX context;
    X509V3_set_ctx(&context, signer.certificate(), nullptr, nullptr, made.get(), 0);
    // RFC 5280 5.2.1: CAs may have the same name.
    X509_EXTENSION* const key =
        X509V3_EXT_conf_nid(nullptr, &context, NID_authority_key_identifier, "keyid");
    X509_CRL_add_ext(made.get(), key, -1);
    X509_EXTENSION_free(key);
    return made;
}

/// RFC 5280 5.2.3: a later list has a higher number, of up to 20 bytes.
void count_up(X509_CRL* list) {
    using Integer = std::unique_ptr<ASN1_INTEGER, decltype(&ASN1_INTEGER_free)>;
    const Integer former(
        static_cast<ASN1_INTEGER*>(X509_CRL_get_ext_d2i(list, NID_crl_number, nullptr, nullptr)),
        ASN1_INTEGER_free);
    const std::unique_ptr<BIGNUM, decltype(&BN_free)> number(
        former ? ASN1_INTEGER_to_BN(former.get(), nullptr) : BN_new(), BN_free);
    BN_add_word(number.get(), 1);
    const Integer next(BN_to_ASN1_INTEGER(number.get(), nullptr), ASN1_INTEGER_free);
    X509_CRL_add1_ext_i2d(list, NID_crl_number, next.get(), 0, X509V3_ADD_REPLACE);
}

void add_revoked(X509_CRL* list, const Signer& signer, std::string_view certificate,
                 ASN1_TIME* time) {
    const auto given = certificates_of(certificate);
    X509* const lost = given.empty() ? nullptr : given.front().get();
    if (lost == nullptr ||
        !signer.has_signed(X509_get_issuer_name(lost), X509_verify(lost, signer.key.get())))
        throw CannotIssue(
            "the file to revoke holds no certificate that this CA has signed; --dir names the "
            "folder of the CA that signed it",
            true);
    X509_REVOKED* entry = nullptr;
    if (X509_CRL_get0_by_cert(list, &entry, lost) != 0) return;
    entry = X509_REVOKED_new();
    X509_REVOKED_set_serialNumber(entry, X509_get_serialNumber(lost));
    X509_REVOKED_set_revocationDate(entry, time);
    X509_CRL_add0_revoked(list, entry);
}

}  // namespace

std::string revoke(const Issued& ca, std::string_view list,
                   const std::optional<std::string_view>& certificate, const Validity& validity) {
    const Signer signer(ca);
    const Owned<X509_CRL> made = former_list(signer, list);
    const std::unique_ptr<ASN1_TIME, decltype(&ASN1_TIME_free)> time(
        ASN1_TIME_set(nullptr, validity.now - kHour), ASN1_TIME_free);
    X509_CRL_set1_lastUpdate(made.get(), time.get());
    if (certificate) add_revoked(made.get(), signer, *certificate, time.get());
    ASN1_TIME_set(time.get(), validity.now + validity.days * kDay);
    X509_CRL_set1_nextUpdate(made.get(), time.get());
    X509_CRL_sort(made.get());
    count_up(made.get());
    if (X509_CRL_sign(made.get(), signer.key.get(), EVP_sha256()) <= 0)
        throw CannotIssue("the CA's key cannot sign");
    return pem_of([&](BIO* out) { return PEM_write_bio_X509_CRL(out, made.get()); });
}

}  // namespace panelgate::tls
