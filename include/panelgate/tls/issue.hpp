#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace panelgate::tls {

/// A certificate and its key, in PEM form.
struct Issued {
    std::string certificate;
    std::string key;
};

/// From now on, in seconds since 1970.
struct Validity {
    std::int64_t now = 0;
    int days = 0;
};

/// A CA file that cannot sign, or a certificate that is none; the text says what would be right.
struct CannotIssue : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// What was asked for cannot be had, whatever the CA: a name that is none, another CA's
/// certificate.
struct WrongName : CannotIssue {
    using CannotIssue::CannotIssue;
};

// What a small plant needs: ECDSA P-256, X.509v3, SHA-256, random serial numbers. A certificate
// begins an hour early, because clocks differ, and ends with its CA at the latest. All throw
// CannotIssue.

Issued issue_ca(const std::string& name, const Validity& validity);
/// `names`: host names and IP addresses; the first one is its subject, as far as that may be long.
Issued issue_server(const Issued& ca, const std::vector<std::string>& names,
                    const Validity& validity);
/// With the extension of Modbus/TCP Security for the role, if one is given.
Issued issue_client(const Issued& ca, const std::string& name,
                    const std::optional<std::string>& role, const Validity& validity);
/// The CA's list of revoked certificates with this one added, which it has signed; `list` is the
/// former one, or "".
std::string revoke(const Issued& ca, std::string_view list,
                   const std::optional<std::string_view>& certificate, const Validity& validity);

}  // namespace panelgate::tls
