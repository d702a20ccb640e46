#include "panelgate/tls/issue.hpp"

#include <openssl/asn1.h>
#include <openssl/bn.h>
#include <openssl/ec.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>
#include <algorithm>
#include <array>
#include <ctime>
#include <memory>

#include "native.hpp"
#include "panelgate/tls/peer.hpp"

namespace panelgate::tls {
namespace {

constexpr std::int64_t kHour = 3600;
constexpr std::int64_t kDay = 24 * kHour;

void check(bool done, const char* what) {
    if (done) return;
    const unsigned long code = ERR_peek_last_error();
    ERR_clear_error();
    const char* const reason = code == 0 ? nullptr : ERR_reason_error_string(code);
    throw CannotIssue(std::string(what) + (reason == nullptr ? "" : std::string(": ") + reason));
}

template <class Write>
std::string pem_of(Write write) {
    const Owned<BIO> out(BIO_new(BIO_s_mem()));
    check(write(out.get()) == 1, "cannot write PEM");
    char* text = nullptr;
    const long size = BIO_get_mem_data(out.get(), &text);
    return {text, static_cast<std::size_t>(std::max(size, 0L))};
}

Owned<EVP_PKEY> new_key() {
    Owned<EVP_PKEY> key(EVP_EC_gen("P-256"));
    check(key != nullptr, "cannot make a key");
    return key;
}

void set_serial(ASN1_INTEGER* serial) {
    std::array<unsigned char, 16> bytes{};
    check(RAND_bytes(bytes.data(), bytes.size()) == 1, "no random numbers");
    bytes[0] &= 0x7f;  // positive
    bytes[0] |= 0x40;
    BIGNUM* const number = BN_bin2bn(bytes.data(), bytes.size(), nullptr);
    BN_to_ASN1_INTEGER(number, serial);
    BN_free(number);
}

/// A CA that may sign.
struct Signer {
    Owned<X509> certificate;
    Owned<EVP_PKEY> key;

    explicit Signer(const Issued& ca) : key(key_of(ca.key)) {
        auto chain = certificates_of(ca.certificate);
        if (chain.empty()) throw CannotIssue("the CA's file holds no certificate");
        certificate = std::move(chain.front());
        if (X509_check_ca(certificate.get()) == 0)
            throw CannotIssue("the CA's certificate is not one of a CA; make one with new-ca");
        if (!key)
            throw CannotIssue("the CA's file holds no key that can be read without a password");
        const bool is_pair = X509_check_private_key(certificate.get(), key.get()) == 1;
        ERR_clear_error();
        if (!is_pair) throw CannotIssue("the CA's key does not belong to its certificate");
    }
};

/// A certificate that is being made.
class Draft {
  public:
    Draft(const std::string& name, EVP_PKEY* key, const Validity& validity, std::int64_t latest) {
        check(certificate_ != nullptr, "no memory");
        X509_set_version(get(), X509_VERSION_3);
        set_serial(X509_get_serialNumber(get()));
        const std::int64_t end = std::min(validity.now + validity.days * kDay, latest);
        ASN1_TIME_set(X509_getm_notBefore(get()), static_cast<time_t>(validity.now - kHour));
        ASN1_TIME_set(X509_getm_notAfter(get()), static_cast<time_t>(end));
        const auto* const text = reinterpret_cast<const unsigned char*>(name.c_str());
        check(X509_NAME_add_entry_by_txt(X509_get_subject_name(get()), "CN", MBSTRING_UTF8, text,
                                         -1, -1, 0) == 1,
              "a name has 1 to 64 characters");
        X509_set_pubkey(get(), key);
    }
    X509* get() const { return certificate_.get(); }

    void extend(const X509* issuer, int kind, const std::string& value) {
        X509V3_CTX context;
        X509V3_set_ctx(&context, const_cast<X509*>(issuer), get(), nullptr, nullptr, 0);
        X509_EXTENSION* const made = X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str());
        check(made != nullptr, "an extension cannot be made");
        X509_add_ext(get(), made, -1);
        X509_EXTENSION_free(made);
    }
    void add_role(const std::string& role) {
        ASN1_UTF8STRING* const text = ASN1_UTF8STRING_new();
        ASN1_STRING_set(text, role.data(), static_cast<int>(role.size()));
        unsigned char* bytes = nullptr;
        const int size = i2d_ASN1_UTF8STRING(text, &bytes);
        ASN1_OCTET_STRING* const value = ASN1_OCTET_STRING_new();
        ASN1_OCTET_STRING_set(value, bytes, size);
        ASN1_OBJECT* const kind = OBJ_txt2obj(std::string(kRoleExtension).c_str(), 1);
        X509_EXTENSION* const made = X509_EXTENSION_create_by_OBJ(nullptr, kind, 0, value);
        X509_add_ext(get(), made, -1);
        X509_EXTENSION_free(made);
        ASN1_OBJECT_free(kind);
        ASN1_OCTET_STRING_free(value);
        OPENSSL_free(bytes);
        ASN1_UTF8STRING_free(text);
    }
    Issued sign(const X509* issuer, EVP_PKEY* issuer_key, EVP_PKEY* own_key) {
        X509_set_issuer_name(get(), X509_get_subject_name(issuer));
        check(X509_sign(get(), issuer_key, EVP_sha256()) > 0, "the CA's key cannot sign");
        Issued issued;
        issued.certificate = pem_of([&](BIO* out) { return PEM_write_bio_X509(out, get()); });
        issued.key = pem_of([&](BIO* out) {
            return PEM_write_bio_PKCS8PrivateKey(out, own_key, nullptr, nullptr, 0, nullptr,
                                                 nullptr);
        });
        return issued;
    }

  private:
    Owned<X509> certificate_{X509_new()};
};

void extend_end_entity(Draft& draft, const X509* ca, const std::string& usage) {
    draft.extend(ca, NID_basic_constraints, "critical,CA:FALSE");
    draft.extend(ca, NID_key_usage, "critical,digitalSignature");
    draft.extend(ca, NID_ext_key_usage, usage);
    draft.extend(ca, NID_subject_key_identifier, "hash");
    draft.extend(ca, NID_authority_key_identifier, "keyid");
}

/// "DNS:gateway.plant,IP:192.168.10.4". A comma would begin another entry.
std::string alternatives_of(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) {
        const bool is_plain = !name.empty() && std::ranges::all_of(name, [](unsigned char c) {
            return std::isalnum(c) != 0 || c == '.' || c == '-' || c == ':' || c == '_' || c == '*';
        });
        if (!is_plain)
            throw CannotIssue("'" + name +
                              "' is no host name or IP address, such as "
                              "gateway.plant.example or 192.168.10.4");
        ASN1_OCTET_STRING* const address = a2i_IPADDRESS(name.c_str());
        text += text.empty() ? "" : ",";
        text += (address != nullptr ? "IP:" : "DNS:") + name;
        ASN1_OCTET_STRING_free(address);
        ERR_clear_error();
    }
    return text;
}

}  // namespace

Issued issue_ca(const std::string& name, const Validity& validity) {
    const Owned<EVP_PKEY> key = new_key();
    Draft draft(name, key.get(), validity, validity.now + validity.days * kDay);
    draft.extend(draft.get(), NID_basic_constraints, "critical,CA:TRUE,pathlen:0");
    draft.extend(draft.get(), NID_key_usage, "critical,keyCertSign,cRLSign");
    draft.extend(draft.get(), NID_subject_key_identifier, "hash");
    return draft.sign(draft.get(), key.get(), key.get());
}

Issued issue_server(const Issued& ca, const std::vector<std::string>& names,
                    const Validity& validity) {
    if (names.empty()) throw CannotIssue("a server's certificate needs at least one name");
    const Signer signer(ca);
    const Owned<EVP_PKEY> key = new_key();
    Draft draft(names.front(), key.get(), validity,
                seconds_of(X509_get0_notAfter(signer.certificate.get())));
    extend_end_entity(draft, signer.certificate.get(), "serverAuth");
    draft.extend(signer.certificate.get(), NID_subject_alt_name, alternatives_of(names));
    return draft.sign(signer.certificate.get(), signer.key.get(), key.get());
}

Issued issue_client(const Issued& ca, const std::string& name,
                    const std::optional<std::string>& role, const Validity& validity) {
    const Signer signer(ca);
    const Owned<EVP_PKEY> key = new_key();
    Draft draft(name, key.get(), validity,
                seconds_of(X509_get0_notAfter(signer.certificate.get())));
    extend_end_entity(draft, signer.certificate.get(), "clientAuth");
    if (role) draft.add_role(*role);
    return draft.sign(signer.certificate.get(), signer.key.get(), key.get());
}

namespace {

/// The former list, or an empty one of this CA.
Owned<X509_CRL> former_list(const Signer& signer, std::string_view list) {
    auto former = lists_of(list);
    if (!former.empty()) return std::move(former.front());
    if (!list.empty())
        throw CannotIssue(
            "the file of revoked certificates holds no list; give the one that revoke wrote");
    Owned<X509_CRL> made(X509_CRL_new());
    X509_CRL_set_version(made.get(), X509_CRL_VERSION_2);
    X509_CRL_set_issuer_name(made.get(), X509_get_subject_name(signer.certificate.get()));
    return made;
}

void add_revoked(X509_CRL* list, X509* certificate, ASN1_TIME* time) {
    X509_REVOKED* known = nullptr;
    ASN1_INTEGER* const serial = X509_get_serialNumber(certificate);
    if (X509_CRL_get0_by_serial(list, &known, serial) == 1) return;
    X509_REVOKED* const entry = X509_REVOKED_new();
    X509_REVOKED_set_serialNumber(entry, serial);
    X509_REVOKED_set_revocationDate(entry, time);
    X509_CRL_add0_revoked(list, entry);
}

}  // namespace

std::string revoke(const Issued& ca, std::string_view list, std::string_view certificate,
                   const Validity& validity) {
    const Signer signer(ca);
    const auto given = certificates_of(certificate);
    if (given.empty()) throw CannotIssue("the file to revoke holds no certificate");
    const Owned<X509_CRL> made = former_list(signer, list);
    ASN1_TIME* const time = ASN1_TIME_set(nullptr, static_cast<time_t>(validity.now));
    add_revoked(made.get(), given.front().get(), time);
    X509_CRL_set1_lastUpdate(made.get(), time);
    ASN1_TIME_set(time, static_cast<time_t>(validity.now + validity.days * kDay));
    X509_CRL_set1_nextUpdate(made.get(), time);
    ASN1_TIME_free(time);
    X509_CRL_sort(made.get());
    check(X509_CRL_sign(made.get(), signer.key.get(), EVP_sha256()) > 0,
          "the CA's key cannot sign");
    return pem_of([&](BIO* out) { return PEM_write_bio_X509_CRL(out, made.get()); });
}

}  // namespace panelgate::tls
