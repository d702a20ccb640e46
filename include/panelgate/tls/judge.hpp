#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/tls/settings.hpp"

namespace panelgate::tls {

/// A certificate's end is announced from this many days before it.
inline constexpr std::int64_t kAnnouncedDays = 14;

/// Returns what is questionable in files that a Context can be made of, a sentence each: dates,
/// names, purpose, age of the list of revoked certificates. `names`: those by which clients reach
/// the listener, as far as they are known. `now`: seconds since 1970. Pure.
std::vector<std::string> doubts(const Settings& settings, const std::vector<std::string>& names,
                                std::int64_t now);

/// Returns what is questionable in a client's files, or makes the files unusable. `server`: the
/// host name or address of the client's server.
std::vector<std::string> client_doubts(const Settings& settings, const std::string& server,
                                       std::int64_t now);

/// Whose certificate it is, for the log.
struct Summary {
    std::string subject;
    std::string issuer;
    std::string serial;
    std::int64_t end = 0;  ///< of its validity, in seconds since 1970
};
/// Describes the first certificate of a PEM text; empty if there is none.
Summary summary_of(std::string_view certificate);

/// "2027-03-01" of a time in seconds since 1970.
std::string date_text(std::int64_t seconds);

}  // namespace panelgate::tls
