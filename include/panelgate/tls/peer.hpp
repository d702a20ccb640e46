#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/base/role.hpp"
#include "panelgate/tls/settings.hpp"

struct x509_st;

namespace panelgate::tls {

/// The role in a client's certificate, Modbus/TCP Security: one UTF8String, the whole of it one
/// role.
inline constexpr std::string_view kRoleExtension = "1.3.6.1.4.1.50316.802.1";

/// Who is at the other end, as its certificate says.
struct Peer {
    std::string subject;              ///< "CN=panel PC 3,O=Plant"; "" without a certificate
    std::optional<std::string> role;  ///< none: no such extension, or none that counts
    std::string role_fault;           ///< why an extension does not count; "" if it does
    bool shown = false;               ///< there is a certificate; its subject may be empty
    /// The first end of validity in its chain up to the CA, in seconds since 1970; 0: none is
    /// shown.
    std::int64_t expiry = 0;
};

/// Reads a certificate; null: nobody. Long names are cut off, control characters replaced.
Peer peer_of(const x509_st* certificate);

/// True if a certificate may carry it as its role.
bool is_role_word(std::string_view word);
/// The role of this name, as in the configuration; none for another word, which only the rules of
/// the plant can know.
Role role_named(std::string_view word);

/// What a client's certificate lets it do, at a listener with `role_from: certificate`.
struct CertifiedRole {
    std::string word{};   ///< its role in its own words; "" none that counts
    Standing standing{};  ///< the least for a word that no role is called
    std::string doubt{};  ///< why the certificate's role does not count; "": no doubt
};

/// Returns nothing where the listener does not go by certificates. Pure.
std::optional<CertifiedRole> certified_role(const std::optional<Settings>& tls, const Peer& peer);

/// A connection keeps the role of its start. Returns why a connection with this certificate must
/// come in anew when the settings `now` follow `before`; "" if its rights are the same.
/// `otherwise`: its rights where certificates do not decide; `least`: with a certificate whose role
/// does not count.
std::string why_other_role(const std::optional<Settings>& before,
                           const std::optional<Settings>& now, const Peer& peer,
                           const Standing& otherwise, const Standing& least);

}  // namespace panelgate::tls
