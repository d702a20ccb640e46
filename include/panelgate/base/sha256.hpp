#pragma once

#include <array>
#include <memory>
#include <string_view>

namespace panelgate {

/// A SHA-256 as 64 lower-case hex digits.
using HexDigest = std::array<char, 64>;
inline std::string_view text_of(const HexDigest& digest) { return {digest.data(), digest.size()}; }

/// SHA-256 (FIPS 180-4) by OpenSSL. Keeps its context: make one where many are needed.
class Sha256 {
  public:
    Sha256();
    ~Sha256();
    Sha256(Sha256&&) noexcept;
    Sha256& operator=(Sha256&&) noexcept;

    /// Returns the hash of the two texts, one after the other. Throws std::runtime_error if OpenSSL
    /// has no SHA-256.
    HexDigest of(std::string_view text, std::string_view more = {});

  private:
    struct Context;
    std::unique_ptr<Context> context_;
};

}  // namespace panelgate
