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
#include <cctype>
#include <ctime>
#include <memory>

#include "native.hpp"
#include "panelgate/base/text.hpp"
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
        if (latest <= validity.now)
            throw CannotIssue("the CA's certificate has expired; make a new one with new-ca");
        X509_set_version(get(), X509_VERSION_3);
        set_serial(X509_get_serialNumber(get()));
        const std::int64_t end =
            std::min(validity.now - kHour + validity.days * kDay - 1, latest);  // both ends count
        ASN1_TIME_set(X509_getm_notBefore(get()), static_cast<time_t>(validity.now - kHour));
        ASN1_TIME_set(X509_getm_notAfter(get()), static_cast<time_t>(end));
        const auto* const text = reinterpret_cast<const unsigned char*>(name.c_str());
        const bool is_name = std::ranges::none_of(name, is_control) &&
                             X509_NAME_add_entry_by_txt(X509_get_subject_name(get()), "CN",
                                                        MBSTRING_UTF8, text, -1, -1, 0) == 1;
        ERR_clear_error();
        if (!is_name) throw WrongName("a name has 1 to 64 characters, of UTF-8, none of control");
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

constexpr std::size_t kLongestSubject = 64;  // X.520, ub-common-name

bool is_address(const std::string& name) {
    ASN1_OCTET_STRING* const address = a2i_IPADDRESS(name.c_str());
    ASN1_OCTET_STRING_free(address);
    ERR_clear_error();
    return address != nullptr;
}

bool is_label(std::string_view label) {
    const auto fits = [](unsigned char c) { return std::isalnum(c) != 0 || c == '-' || c == '_'; };
    return !label.empty() && label.size() <= 63 && label.front() != '-' && label.back() != '-' &&
           std::ranges::all_of(label, fits);
}

/// RFC 1123 2.1, RFC 6125 6.4.3: a '*' is the whole first label. What ends with a number is an
/// address, or none.
bool is_host(std::string_view name) {
    if (name.size() > 253) return false;
    const bool is_wild = name.starts_with("*.");
    if (is_wild) name.remove_prefix(2);
    std::size_t labels = 0;
    std::string_view last;
    for (std::size_t end = 0; end != name.npos;
         name.remove_prefix(end == name.npos ? 0 : end + 1)) {
        end = name.find('.');
        last = name.substr(0, end);
        if (!is_label(last)) return false;
        ++labels;
    }
    const bool is_number =
        std::ranges::all_of(last, [](unsigned char c) { return std::isdigit(c) != 0; });
    return !is_number && (!is_wild || labels > 1);
}

/// "gw" of "gw:8443", "https://gw/"; "" where no name is in it.
std::string name_in(std::string name) {
    if (const std::size_t scheme = name.find("://"); scheme != name.npos) name.erase(0, scheme + 3);
    if (name.starts_with('[')) return name.substr(1, name.find(']') - 1);
    // The zone of an address means something on one machine only.
    if (const std::string bare = name.substr(0, name.find('%')); is_address(bare)) return bare;
    name.resize(std::min(name.find_first_of(":/"), name.size()));
    return is_address(name) || is_host(name) ? name : "";
}

void check_name(const std::string& name) {
    if (is_address(name) || is_host(name)) return;
    const std::string meant = name_in(name);
    throw WrongName("'" + name + "' is no host name or IP address, " +
                    (meant.empty() ? "such as gateway.plant.example or 192.168.10.4"
                                   : "without a port or more; write " + meant));
}

/// A subject is short; what clients compare are the alternatives.
std::string subject_for(const std::vector<std::string>& names) {
    const auto fits = [](const std::string& name) { return name.size() <= kLongestSubject; };
    const auto found = std::ranges::find_if(names, fits);
    return found != names.end() ? *found : names.front().substr(0, names.front().find('.'));
}

/// "DNS:gateway.plant,IP:192.168.10.4".
std::string alternatives_of(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names)
        text += (text.empty() ? "" : ",") + std::string(is_address(name) ? "IP:" : "DNS:") + name;
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
    if (names.empty()) throw WrongName("a server's certificate needs at least one name");
    std::ranges::for_each(names, check_name);
    const Signer signer(ca);
    const Owned<EVP_PKEY> key = new_key();
    Draft draft(subject_for(names), key.get(), validity,
                seconds_of(X509_get0_notAfter(signer.certificate.get())));
    extend_end_entity(draft, signer.certificate.get(), "serverAuth");
    draft.extend(signer.certificate.get(), NID_subject_alt_name, alternatives_of(names));
    return draft.sign(signer.certificate.get(), signer.key.get(), key.get());
}

Issued issue_client(const Issued& ca, const std::string& name,
                    const std::optional<std::string>& role, const Validity& validity) {
    if (role && !is_role_word(*role))
        throw WrongName("a role is a word of 1 to 64 bytes of UTF-8, none of control");
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
    if (!former.empty()) {
        const bool is_own = X509_NAME_cmp(X509_CRL_get_issuer(former.front().get()),
                                          X509_get_subject_name(signer.certificate.get())) == 0 &&
                            X509_CRL_verify(former.front().get(), signer.key.get()) == 1;
        ERR_clear_error();
        if (!is_own)
            throw CannotIssue(
                "the former list of revoked certificates is another CA's; --dir names "
                "the folder of the CA and its list");
        return std::move(former.front());
    }
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

/// A list says nothing of what another CA has signed.
void check_issued_by(const Signer& signer, X509* certificate) {
    X509* const ca = signer.certificate.get();
    if (X509_cmp(ca, certificate) == 0)
        throw WrongName("this is the CA itself; put another one in its place everywhere instead");
    const bool is_own =
        X509_NAME_cmp(X509_get_issuer_name(certificate), X509_get_subject_name(ca)) == 0 &&
        X509_verify(certificate, signer.key.get()) == 1;
    ERR_clear_error();
    if (!is_own)
        throw WrongName("the certificate of " + subject_of(certificate) + " is signed by " +
                        name_text(X509_get_issuer_name(certificate)) +
                        ", not by this CA; --dir names the folder of the CA that signed it");
}

Owned<X509> revocable(const Signer& signer, std::string_view certificate) {
    auto given = certificates_of(certificate);
    if (given.empty()) throw WrongName("the file to revoke holds no certificate");
    check_issued_by(signer, given.front().get());
    return std::move(given.front());
}

/// RFC 5280 5.2.1, for programs that look lists up: CAs may have the same name.
void name_signer(X509_CRL* list, const X509* ca) {
    const ASN1_OCTET_STRING* const key = X509_get0_subject_key_id(const_cast<X509*>(ca));
    if (key == nullptr || X509_CRL_get_ext_by_NID(list, NID_authority_key_identifier, -1) >= 0)
        return;
    AUTHORITY_KEYID* const name = AUTHORITY_KEYID_new();
    name->keyid = ASN1_OCTET_STRING_dup(key);
    X509_CRL_add1_ext_i2d(list, NID_authority_key_identifier, name, 0, 0);
    AUTHORITY_KEYID_free(name);
}

}  // namespace

std::string revoke(const Issued& ca, std::string_view list,
                   const std::optional<std::string_view>& certificate, const Validity& validity) {
    const Signer signer(ca);
    const Owned<X509_CRL> made = former_list(signer, list);
    // As of certificates: clocks differ.
    ASN1_TIME* const time = ASN1_TIME_set(nullptr, static_cast<time_t>(validity.now - kHour));
    if (certificate) add_revoked(made.get(), revocable(signer, *certificate).get(), time);
    X509_CRL_set1_lastUpdate(made.get(), time);
    ASN1_TIME_set(time, static_cast<time_t>(validity.now + validity.days * kDay));
    X509_CRL_set1_nextUpdate(made.get(), time);
    ASN1_TIME_free(time);
    name_signer(made.get(), signer.certificate.get());
    X509_CRL_sort(made.get());
    check(X509_CRL_sign(made.get(), signer.key.get(), EVP_sha256()) > 0,
          "the CA's key cannot sign");
    return pem_of([&](BIO* out) { return PEM_write_bio_X509_CRL(out, made.get()); });
}

}  // namespace panelgate::tls
