#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "panelgate/base/role.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::tls {

class Context;

/// Whether clients show a certificate. A certificate that is shown must always be good.
enum class ClientCertificate : std::uint8_t { none, optional, required };
enum class Version : std::uint8_t { tls12, tls13 };

/// The contents of the files, in PEM form; "" for a file that is not named.
struct Material {
    std::string certificate;
    std::string key;
    std::string ca;
    std::string crl;
    friend bool operator==(const Material&, const Material&) = default;
};

/// Settings of the `tls` map of a listener.
struct Settings {
    std::string certificate;  ///< path: the server's certificate, then those up to its CA
    std::string key;          ///< path
    std::string ca;           ///< path: who may have signed a client's certificate
    std::string crl;          ///< path: certificates that their CA has revoked; "" none
    ClientCertificate client = ClientCertificate::none;
    bool role_from_certificate = false;
    Version lowest = Version::tls12;
    Duration handshake_timeout = 10s;
    std::size_t max_handshakes = 128;  ///< at the same time; the oldest gives way to the next
    std::size_t max_handshakes_per_address = 16;
    Duration between_handshakes = 20ms;  ///< two that begin
    Material material{};
    std::vector<OwnRole> own_roles{};       ///< that a client's certificate may name
    std::vector<std::string> rule_roles{};  ///< words besides that rules of `access` go by
    /// Made of the settings by whoever read the files, which takes milliseconds; null: not yet.
    std::shared_ptr<const Context> made{};

    friend bool operator==(const Settings& one, const Settings& other) {
        const auto all = [](const Settings& of) {
            return std::tie(of.certificate, of.key, of.ca, of.crl, of.client,
                            of.role_from_certificate, of.lowest, of.handshake_timeout,
                            of.max_handshakes, of.max_handshakes_per_address, of.between_handshakes,
                            of.material, of.own_roles, of.rule_roles);
        };
        return all(one) == all(other);
    }
};

/// True if every client has to show a certificate; without TLS no client has to.
inline bool wants_certificate(const std::optional<Settings>& tls) {
    return tls && tls->client == ClientCertificate::required;
}
/// True if the role in a client's certificate decides what the client may do.
inline bool goes_by_certificates(const std::optional<Settings>& tls) {
    return tls && tls->role_from_certificate;
}

}  // namespace panelgate::tls
