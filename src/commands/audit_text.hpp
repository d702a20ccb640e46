#pragma once

#include <boost/json/object.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/base/time.hpp"

namespace panelgate::commands {

/// Which records are shown; empty texts: all.
struct AuditFilter {
    std::string station{};  ///< its name; empty: it has none, or none is asked for
    std::string line{};     ///< of that station; its broadcasts are the station's, too
    std::string id{};       ///< of that station, where its line is known
    std::string kind{};
    std::string client{};  ///< part of its name, address, token or user
    std::string since{};   ///< RFC 3339, as in records; from
    std::string until{};   ///< ... and before
};
bool is_shown(const boost::json::object& record, const AuditFilter& filter);

/// A record for a person, in one line: "2026-11-26T09:00:00.123Z  17 write  press UW102 = 21 (was
/// 20)  confirmed  http 10.0.0.7 token ops".
std::string audit_line(const boost::json::object& record);

/// What `--since` means, as in records: a span before `now` ("90s", "30min", "1h", "7d"), or a time
/// (RFC 3339 in UTC, or its beginning, a day). nullopt for anything else.
std::optional<std::string> audit_time(std::string_view typed, WallTime now);

}  // namespace panelgate::commands
