#include "panelgate/tls/roles.hpp"

#include <algorithm>

namespace panelgate::tls {
std::optional<CertifiedRole> certified_role(const std::optional<Settings>& tls, const Peer& peer) {
    if (!goes_by_certificates(tls)) return std::nullopt;
    CertifiedRole role;
    role.doubt = peer.role_fault;
    if (!peer.role) return role;
    role.word = *peer.role;
    role.standing = standing_named(role.word, tls->own_roles);
    const bool counts =
        role.standing != Standing{} || std::ranges::count(tls->rule_roles, role.word) > 0;
    if (!counts) role.doubt = "its role is " + role.word + ", and no role here is called that";
    return role;
}

std::string why_other_role(const std::optional<Settings>& before,
                           const std::optional<Settings>& now, const Peer& peer,
                           const Standing& otherwise, const Standing& least) {
    const auto standing = [&](const std::optional<Settings>& tls) {
        const auto role = certified_role(tls, peer);
        if (!role) return otherwise;
        return role->standing == Standing{} ? least : role->standing;
    };
    if (standing(before) == standing(now)) return "";
    return goes_by_certificates(before) != goes_by_certificates(now)
               ? "role_from has changed, and with it what its certificate allows"
               : "access.roles have changed, and with them what its role allows";
}

}  // namespace panelgate::tls
