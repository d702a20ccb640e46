#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "panelgate/tls/settings.hpp"

namespace panelgate::tls {

/// How new files come into use: somebody asks for it, or they are seen to have changed.
enum class Arrival : std::uint8_t { asked_for, noticed };

/// Why files that a Context can be made of must not take the place of those in use, in one
/// sentence; "" if they may. Good ones give way neither to a pair that is not valid now nor to a
/// list of revoked certificates that is overdue or another CA's. Where nobody has asked, the pair
/// keeps the names and the CA that clients know, the CA still signs the gateway's own certificate
/// if it did, and a list is no older. `now`: seconds since 1970. Pure.
std::string why_kept(const Settings& used, const Settings& fresh, Arrival arrival,
                     std::int64_t now);

/// The same of a client's files.
std::string why_client_kept(const Settings& used, const Settings& fresh, std::int64_t now);

/// Whose certificate it is, for the log.
struct Summary {
    std::string subject;
    std::string issuer;
    std::string serial;
    std::int64_t begin = 0;  ///< of its validity, in seconds since 1970
    std::int64_t end = 0;
};
/// Of the first certificate of a PEM text; empty if there is none.
Summary summary_of(std::string_view certificate);

/// The keys whose files differ: "certificate, key".
std::string changed_files(const Material& before, const Material& now);

}  // namespace panelgate::tls
