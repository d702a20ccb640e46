#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "panelgate/tls/settings.hpp"

namespace panelgate::tls {

/// From then on a certificate's end is announced.
inline constexpr std::int64_t kAnnouncedDays = 14;

/// What is questionable in files that a Context can be made of, a sentence each: dates, names,
/// chain, purpose, age of the list of revoked certificates. `names`: those by which clients reach
/// the listener, as far as they are known. `now`: seconds since 1970. Pure.
std::vector<std::string> doubts(const Settings& settings, const std::vector<std::string>& names,
                                std::int64_t now);

/// The same of a client's files, and what makes them unusable. `server`: whom it asks.
std::vector<std::string> client_doubts(const Settings& settings, const std::string& server,
                                       std::int64_t now);

/// "2027-03-01" of a time in seconds since 1970.
std::string date_text(std::int64_t seconds);

}  // namespace panelgate::tls
