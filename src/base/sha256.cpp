#include "panelgate/base/sha256.hpp"

#include <openssl/evp.h>
#include <cstddef>
#include <stdexcept>

namespace panelgate {

struct Sha256::Context {
    Context() = default;
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;
    ~Context() {
        EVP_MD_CTX_free(context);
        EVP_MD_free(sha256);
    }
    EVP_MD* sha256 = EVP_MD_fetch(nullptr, "SHA256", nullptr);
    EVP_MD_CTX* context = EVP_MD_CTX_new();
};

Sha256::Sha256() : context_(std::make_unique<Context>()) {}
Sha256::~Sha256() = default;
Sha256::Sha256(Sha256&&) noexcept = default;
Sha256& Sha256::operator=(Sha256&&) noexcept = default;

HexDigest Sha256::of(std::string_view text, std::string_view more) {
    std::array<unsigned char, 32> bytes{};
    const bool done = context_->sha256 != nullptr && context_->context != nullptr &&
                      EVP_DigestInit_ex2(context_->context, context_->sha256, nullptr) == 1 &&
                      EVP_DigestUpdate(context_->context, text.data(), text.size()) == 1 &&
                      EVP_DigestUpdate(context_->context, more.data(), more.size()) == 1 &&
                      EVP_DigestFinal_ex(context_->context, bytes.data(), nullptr) == 1;
    if (!done) throw std::runtime_error("OpenSSL has no SHA-256");
    constexpr std::string_view kDigits = "0123456789abcdef";
    HexDigest digest{};
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        digest[2 * i] = kDigits[bytes[i] >> 4U];
        digest[2 * i + 1] = kDigits[bytes[i] & 0x0fU];
    }
    return digest;
}

}  // namespace panelgate
