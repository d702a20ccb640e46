#include "own_pair.hpp"

#include <openssl/err.h>
#include <algorithm>
#include <array>
#include <limits>
#include <string_view>

#include "panelgate/tls/context.hpp"

namespace panelgate::tls {

void check_whole(const char* key, const std::string& file, std::string_view content,
                 std::string_view kind, std::size_t read) {
    if (!is_whole(content, kind, read))
        throw Unusable(key, file +
                                " is damaged or cut off: not all that it holds can be read; "
                                "copy it again, and under its name in one step (mv)");
}

namespace {

/// RFC 8446 4.2.3: what clients offer.
bool is_spoken(const EVP_PKEY* key) {
    switch (EVP_PKEY_get_base_id(key)) {
        case EVP_PKEY_RSA:
        case EVP_PKEY_RSA_PSS:
        case EVP_PKEY_ED25519:
        case EVP_PKEY_ED448:
            return true;
        case EVP_PKEY_EC:
            break;
        default:
            return false;
    }
    std::array<char, 32> curve{};
    std::size_t size = 0;
    if (EVP_PKEY_get_group_name(key, curve.data(), curve.size(), &size) != 1) return false;
    constexpr std::array<std::string_view, 3> kSpoken{"prime256v1", "secp384r1", "secp521r1"};
    return std::ranges::count(kSpoken, std::string_view(curve.data(), size)) > 0;
}

std::string last_reason() {
    const unsigned long code = ERR_peek_last_error();
    ERR_clear_error();
    const char* text = code == 0 ? nullptr : ERR_reason_error_string(code);
    return text == nullptr ? "" : std::string(" (") + text + ')';
}

std::int64_t use_certificate(SSL_CTX* context, const Settings& settings) {
    const auto chain = certificates_of(settings.material.certificate);
    if (chain.empty())
        throw Unusable("certificate", settings.certificate +
                                          " holds no certificate; give a file in PEM form "
                                          "(-----BEGIN CERTIFICATE-----)");
    check_whole("certificate", settings.certificate, settings.material.certificate, "CERTIFICATE",
                chain.size());
    if (SSL_CTX_use_certificate(context, chain.front().get()) != 1)
        throw Unusable("certificate", "the certificate in " + settings.certificate +
                                          " cannot be used" + last_reason() +
                                          "; make one with ECDSA P-256, or RSA of 2048 bits or "
                                          "more, and SHA-256");
    for (std::size_t i = 1; i < chain.size(); ++i) SSL_CTX_add1_chain_cert(context, chain[i].get());
    std::int64_t end = std::numeric_limits<std::int64_t>::max();
    for (const auto& one : chain) end = std::min(end, seconds_of(X509_get0_notAfter(one.get())));
    return end;
}

void use_key(SSL_CTX* context, const Settings& settings) {
    const Owned<EVP_PKEY> key = key_of(settings.material.key);
    if (!key)
        throw Unusable("key", settings.key +
                                  " holds no private key that can be read; give a file in PEM form "
                                  "(-----BEGIN PRIVATE KEY-----), without a password");
    const X509* const certificate = SSL_CTX_get0_certificate(context);
    if (X509_check_private_key(certificate, key.get()) != 1) {
        ERR_clear_error();
        throw Unusable("key", "the key in " + settings.key +
                                  " does not belong to the certificate in " + settings.certificate +
                                  "; give the key that it was made with");
    }
    if (!is_spoken(key.get()))
        throw Unusable("key",
                       "the key in " + settings.key +
                           " is of a kind that TLS clients do not speak; make one with ECDSA "
                           "P-256, or RSA of 2048 bits or more");
    if (SSL_CTX_use_PrivateKey(context, key.get()) != 1)
        throw Unusable("key", "the key in " + settings.key + " cannot be used" + last_reason() +
                                  "; make one with ECDSA P-256, or RSA of 2048 bits or more");
}

}  // namespace

std::int64_t use_pair(SSL_CTX* context, const Settings& settings) {
    const std::int64_t end = use_certificate(context, settings);
    use_key(context, settings);
    return end;
}

std::vector<Owned<X509>> trusted_authorities(const Settings& settings, const char* advice) {
    auto trusted = certificates_of(settings.material.ca);
    if (trusted.empty())
        throw Unusable("ca", settings.ca + " holds no certificate; give " + advice);
    check_whole("ca", settings.ca, settings.material.ca, "CERTIFICATE", trusted.size());
    return trusted;
}

}  // namespace panelgate::tls
