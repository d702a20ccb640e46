#include "panelgate/tls/peer.hpp"

#include <openssl/asn1.h>
#include <openssl/objects.h>
#include <openssl/x509.h>
#include <algorithm>

#include "native.hpp"
#include "panelgate/base/text.hpp"

namespace panelgate::tls {
namespace {

constexpr std::size_t kLongestRole = 64;

int nid_of_role() {
    static const int kNid = [] {
        const std::string oid(kRoleExtension);
        const int known = OBJ_txt2nid(oid.c_str());
        return known != NID_undef ? known : OBJ_create(oid.c_str(), "modbusRole", "Modbus role");
    }();
    return kNid;
}

/// The text of an extension; a fault in `peer` where it is no role. In DER a UTF8String of less
/// than 128 bytes is its tag, its length and the text, and X.509 has no other encoding.
void read_role(const ASN1_OCTET_STRING* value, Peer& peer) {
    constexpr char kTag = 0x0c;
    constexpr std::size_t kHead = 2;
    const auto* const begin = reinterpret_cast<const char*>(ASN1_STRING_get0_data(value));
    std::string role(begin, static_cast<std::size_t>(ASN1_STRING_length(value)));
    if (role.size() < kHead || role.size() >= kHead + 128 || role[0] != kTag ||
        static_cast<std::size_t>(role[1]) != role.size() - kHead) {
        peer.role_fault = "its role is not one UTF8String";
        return;
    }
    role.erase(0, kHead);
    if (!is_role_word(role)) {
        peer.role_fault = "its role is not a word of 1 to 64 bytes of UTF-8";
        return;
    }
    peer.role = std::move(role);
}

}  // namespace

bool is_role_word(std::string_view word) {
    const bool has_control = std::ranges::any_of(word, is_control);
    return !word.empty() && word.size() <= kLongestRole && !has_control && is_utf8(word);
}

Role role_named(std::string_view word) { return standing_named(word, {}).role; }

Peer peer_of(const x509_st* certificate) {
    Peer peer;
    if (certificate == nullptr) return peer;
    peer.shown = true;
    peer.subject = subject_of(certificate);
    const int at = X509_get_ext_by_NID(certificate, nid_of_role(), -1);
    if (at < 0) return peer;
    if (X509_get_ext_by_NID(certificate, nid_of_role(), at) >= 0) {
        peer.role_fault = "it has more than one role";
        return peer;
    }
    read_role(X509_EXTENSION_get_data(X509_get_ext(certificate, at)), peer);
    return peer;
}

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
