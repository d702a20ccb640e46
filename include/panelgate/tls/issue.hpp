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

/// The text says what would be right. `wrong_name`: no CA could do what was asked for.
struct CannotIssue : std::runtime_error {
    explicit CannotIssue(const std::string& why, bool wrong_name = false)
        : std::runtime_error(why), wrong_name(wrong_name) {}
    bool wrong_name;
};

// What a small plant needs: ECDSA P-256, X.509v3, SHA-256, random serial numbers. A certificate
// begins an hour early, because clocks differ, and ends with its CA at the latest. All functions
// throw CannotIssue.

Issued issue_ca(const std::string& name, const Validity& validity);
/// `names`: host names and IP addresses; the first name of at most 64 characters is the subject.
Issued issue_server(const Issued& ca, const std::vector<std::string>& names,
                    const Validity& validity);
/// With the extension of Modbus/TCP Security for the role, if one is given.
Issued issue_client(const Issued& ca, const std::string& name,
                    const std::optional<std::string>& role, const Validity& validity);
/// Returns the CA's list of revoked certificates with this certificate added; `list` is the former
/// list, or "".
std::string revoke(const Issued& ca, std::string_view list,
                   const std::optional<std::string_view>& certificate, const Validity& validity);

}  // namespace panelgate::tls
