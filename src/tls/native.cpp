#include "native.hpp"
#include "panelgate/base/text.hpp"

#include <openssl/asn1.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <algorithm>
#include <array>
#include <cstdint>
#include <ctime>

namespace panelgate::tls {
namespace {

constexpr std::size_t kLongestName = 200;
/// Characters that end a line, or turn the rest of it round, where a log is shown.
constexpr std::array<std::string_view, 13> kTurnsLines{
    "\u0085", "\u2028", "\u2029", "\u200e", "\u200f", "\u202a", "\u202b",
    "\u202c", "\u202d", "\u202e", "\u2066", "\u2067", "\u2069"};

int no_password(char*, int, int, void*) { return 0; }

template <class T, class Read>
std::vector<Owned<T>> all_of(std::string_view pem, Read read) {
    std::vector<Owned<T>> found;
    const Owned<BIO> in = reader_of(pem);
    while (T* one = read(in.get())) found.emplace_back(one);
    ERR_clear_error();
    return found;
}

}  // namespace

Owned<BIO> reader_of(std::string_view text) {
    return Owned<BIO>(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

std::vector<Owned<X509>> certificates_of(std::string_view pem) {
    return all_of<X509>(
        pem, [](BIO* in) { return PEM_read_bio_X509(in, nullptr, no_password, nullptr); });
}

std::vector<Owned<X509_CRL>> lists_of(std::string_view pem) {
    return all_of<X509_CRL>(
        pem, [](BIO* in) { return PEM_read_bio_X509_CRL(in, nullptr, no_password, nullptr); });
}

bool has_signed(const X509* authority, X509_CRL* list) {
    const bool signed_it =
        X509_NAME_cmp(X509_get_subject_name(authority), X509_CRL_get_issuer(list)) == 0 &&
        X509_CRL_verify(list, X509_get0_pubkey(authority)) == 1;
    ERR_clear_error();
    return signed_it;
}

std::vector<X509*> without_list(const std::vector<Owned<X509>>& authorities,
                                const std::vector<Owned<X509_CRL>>& lists) {
    std::vector<X509*> found;
    for (const auto& authority : authorities)
        if (std::ranges::none_of(
                lists, [&](const auto& list) { return has_signed(authority.get(), list.get()); }))
            found.push_back(authority.get());
    return found;
}

bool expect_peer(X509_VERIFY_PARAM* verification, const std::string& server) {
    if (X509_VERIFY_PARAM_set1_ip_asc(verification, server.c_str()) == 1) return false;
    X509_VERIFY_PARAM_set1_host(verification, server.data(), server.size());
    return true;
}

Owned<EVP_PKEY> key_of(std::string_view pem) {
    const Owned<BIO> in = reader_of(pem);
    Owned<EVP_PKEY> key(PEM_read_bio_PrivateKey(in.get(), nullptr, no_password, nullptr));
    ERR_clear_error();
    return key;
}

std::int64_t seconds_of(const ASN1_TIME* time) {
    std::tm parts{};
    if (ASN1_TIME_to_tm(time, &parts) != 1) return 0;
    return ::timegm(&parts);
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

bool is_whole(std::string_view pem, std::string_view kind, std::size_t read) {
    constexpr std::string_view kDashes = "-----";
    const auto count = [&](std::string_view mark) {
        std::size_t found = 0;
        for (std::size_t at = pem.find(mark); at != pem.npos; at = pem.find(mark, at + 1)) {
            const std::string_view rest = pem.substr(at + mark.size());
            const std::size_t end = rest.find(kDashes);
            if (end != rest.npos && rest.substr(0, end).ends_with(kind)) ++found;
        }
        return found;
    };
    const std::size_t last = pem.rfind("-----END ");
    const bool begins_another = last != pem.npos && pem.find("-----B", last) != pem.npos;
    return !begins_another && count("-----BEGIN ") == read && count("-----END ") == read;
}

}  // namespace panelgate::tls
