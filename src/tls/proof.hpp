#pragma once

#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <optional>
#include <string>
#include <vector>

#include "native.hpp"
#include "panelgate/tls/context.hpp"
#include "panelgate/tls/counters.hpp"

namespace panelgate::tls {

/// Why a client is not let in.
struct Refusal {
    Outcome outcome = Outcome::untrusted;
    std::string why;
};
/// The certificate that a verification has stopped at, in words.
std::string blamed(X509_STORE_CTX* judging);
/// What X509_V_ERR_* says of a certificate: "has expired".
std::string words_of_chain(long result);
/// Of a certificate's verification, X509_V_ERR_*.
Refusal refusal_of(long result, const std::string& blamed);

/// What a client has shown in its handshake, for another look at it when the rules have changed.
/// May be used by any thread, as soon as the handshake is over.
class Proof {
  public:
    explicit Proof(SSL* connection);

    /// Why this client would not be let in by these rules; nothing: it would.
    std::optional<Refusal> refusal_by(const Context& context) const;

  private:
    std::optional<Refusal> judge_chain(const Context& context) const;

    int version_;
    Owned<X509> certificate_;          ///< null: it has shown none
    std::vector<Owned<X509>> others_;  ///< those between it and its CA
};

}  // namespace panelgate::tls
