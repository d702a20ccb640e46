#pragma once

#include <array>
#include <boost/json/object.hpp>
#include <string>
#include <string_view>

#include "panelgate/base/time.hpp"

namespace panelgate::audit {

/// The kinds of records: stable identifiers.
inline constexpr std::array<std::string_view, 13> kKinds{
    "start",          // the gateway has started
    "end",            // ... and ends in order
    "write",          // a write, whatever became of it
    "refusal",        // a request that was refused
    "repeats",        // how often one client repeated what is recorded above
    "login",          // a log-in that failed
    "reload",         // reload or rollback
    "configuration",  // the text of the configuration was read, checked or written
    "discovery",      // a search for stations
    "simulator",      // a fault of a simulated panel was set
    "token",          // a token came, went, changed or expired
    "file",           // a file begins
    "lost",           // records were left out: the disk took nothing for too long
};

/// A record, or some of its members, in the order of the file; the chain adds number and hash.
using Members = boost::json::object;

/// Returns a record with its time (UTC, milliseconds) and kind, one of kKinds.
Members record_of(std::string_view kind, WallTime time);
/// Returns a time as records have it: "2026-11-26T09:00:00.123Z".
std::string time_text(WallTime time);
/// Adds a text; an empty text is left out. Bytes that are no UTF-8 become U+FFFD.
void add_text(Members& record, std::string_view key, std::string_view value);
/// Adds members behind those that are there.
void add(Members& record, const Members& more);
/// Returns the record as JSON without its braces: what Chain::append() takes.
std::string body_of(const Members& record);

}  // namespace panelgate::audit
