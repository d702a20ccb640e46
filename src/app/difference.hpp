#pragma once

#include <boost/json/array.hpp>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/config/config.hpp"

namespace panelgate::app {

/// One thing in which two configurations differ.
struct Change {
    enum class Kind : std::uint8_t { added, removed, changed };
    /// As Held::path: "lines/floor1/stations/press/poll/UW0/every".
    std::string path;
    Kind kind = Kind::changed;
    /// As the file writes them; both are "" of what has settings of its own (a line that was added
    /// is told as one change), of secrets, and of profiles.
    std::string before;
    std::string after;
};
std::string_view label(Change::Kind kind);

/// What changes from one to the other, sorted by path; empty when both mean the same. What a line
/// hands down to its stations is told once, of the line. Pure; of a large plant it takes a tenth of
/// a second or so.
std::vector<Change> differences(const config::Config& before, const config::Config& after);

/// Units of a listener that reach another line, because the one they went to is not the listener's
/// any more: a write to them would reach somebody else's panel. A sentence each. Pure.
std::vector<std::string> moved_units(const config::Config& before, const config::Config& after);

/// "lines/floor1/stations/press/poll/UW0: every 1s -> 2s", "lines/floor2: added"
std::string to_string(const Change& change);
/// {"path", "kind", "before", "after"} each; the last two where they are told.
boost::json::array to_json(const std::vector<Change>& changes);

}  // namespace panelgate::app
