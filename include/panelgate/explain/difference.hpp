#pragma once

#include <boost/json/array.hpp>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/config/config.hpp"

namespace panelgate::explain {

/// One thing in which two configurations differ.
struct Change {
    enum class Kind : std::uint8_t { added, removed, changed };
    /// As Setting::path: "lines/floor1/stations/press/poll/UW0/every".
    std::string path;
    Kind kind = Kind::changed;
    /// The values as written in the file. Both are "" for secrets, profiles and entries with
    /// settings of their own (an added line is reported as one change).
    std::string before;
    std::string after;
    /// Effect of a reload beside taking the value over: "the port is opened anew"; "" without an
    /// effect.
    std::string needs = {};
    bool weaker = false;  ///< it protects the panels less (config::Weaker), or may do so
};
std::string_view label(Change::Kind kind);

/// The changes between two configurations, sorted by path; empty if both mean the same. A setting
/// that stations inherit from their line is reported once, for the line. Pure; takes about 0.1 s
/// for a large plant.
std::vector<Change> differences(const config::Config& before, const config::Config& after);

/// The changes by which `after` protects less, one line each: who may write, who may connect and
/// from where, what a guard refuses, roles and tokens, what the gateway writes by itself (repeated
/// writes, relays), and what the audit keeps. Doubtful cases are listed. Pure.
std::vector<std::string> weaker(const config::Config& before, const config::Config& after);

/// "lines/floor1/stations/press/poll/UW0: every 1s -> 2s", "lines/floor2: added"; without what it
/// needs.
std::string to_string(const Change& change);
/// {"path", "kind", "before", "after", "needs"} each; the last three unless they are empty.
boost::json::array to_json(const std::vector<Change>& changes);

/// The listeners by their names in Setting::path; `config` outlives the map.
std::map<std::string, const tcp_server::Settings*> listeners_of(const config::Config& config);

/// What is cut when another configuration is taken over.
struct Interruption {
    std::string path;  ///< as Change::path: "lines/floor1"
    std::string what;  ///< "the port is opened anew"
};
/// What a reload interrupts, also by what is removed or renamed. Judged as the running parts judge
/// it. Pure.
std::vector<Interruption> interruptions(const config::Config& before, const config::Config& after);

/// {"path", "what"} each.
boost::json::array to_json(const std::vector<Interruption>& interruptions);

/// Units of a listener or serial master by which a client would now reach another panel: the line
/// of their station was taken away, its id or its alias has changed, stations are swapped. One
/// sentence each. Units that reach nobody now are not listed, nor a panel that only has another
/// name. Pure.
std::vector<std::string> moved_units(const config::Config& before, const config::Config& after);

}  // namespace panelgate::explain
