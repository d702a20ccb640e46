#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace panelgate::tls {

/// How a handshake ended. The words are metric labels.
enum class Outcome : std::uint8_t {
    done,
    no_certificate,  ///< the client has none, and must
    expired,         ///< the client's certificate is, or is not valid yet
    revoked,
    untrusted,  ///< signed by another CA, or not a client's certificate
    refused,    ///< the client does not take the server's certificate
    version,    ///< no version or cipher suite in common
    plain,      ///< the client does not speak TLS
    timeout,
    displaced,  ///< too many at the same time
    broken,     ///< cut off, or against the protocol
};
inline constexpr std::array<std::string_view, 11> kOutcomeWords{
    "done",    "no_certificate", "expired", "revoked",   "untrusted", "refused",
    "version", "plain",          "timeout", "displaced", "broken"};
inline constexpr std::string_view label(Outcome outcome) {
    return kOutcomeWords[static_cast<std::size_t>(outcome)];
}

struct Counters {
    std::array<std::uint64_t, kOutcomeWords.size()> handshakes{};  ///< by outcome
    /// End of the server's certificate, in seconds since 1970; 0: the listener has no TLS.
    std::int64_t certificate_expiry = 0;
};

/// What became of new certificate files of one listener.
struct Renewals {
    std::uint64_t replaced = 0;  ///< in use
    std::uint64_t kept = 0;      ///< not taken: the former ones stay in use
};

}  // namespace panelgate::tls
