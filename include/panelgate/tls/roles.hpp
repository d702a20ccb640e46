#pragma once

#include <optional>
#include <string>

#include "panelgate/base/role.hpp"
#include "panelgate/tls/peer.hpp"
#include "panelgate/tls/settings.hpp"

namespace panelgate::tls {

/// What a client's certificate lets it do, at a listener with `role_from: certificate`.
struct CertifiedRole {
    std::string word{};   ///< its role in its own words; "" none that counts
    Standing standing{};  ///< the least for a word that no role is called
    std::string doubt{};  ///< why the role in it does not count; "" if it does, or there is none
};

/// Nothing where the listener does not go by certificates. Pure, like the next.
std::optional<CertifiedRole> certified_role(const std::optional<Settings>& tls, const Peer& peer);

/// A connection keeps the role that it came in with. Why one with this certificate must come in
/// anew when these settings follow those; "" if it may do the same. `otherwise`: what it may where
/// certificates do not decide; `least`: by a certificate without a role that counts.
std::string why_other_role(const std::optional<Settings>& before,
                           const std::optional<Settings>& now, const Peer& peer,
                           const Standing& otherwise, const Standing& least);

}  // namespace panelgate::tls
