#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/audit/chain.hpp"

namespace panelgate::audit {

/// The first thing that is wrong with a chain.
struct Fault {
    std::string_view kind{};  ///< "changed", "removed", "added", "torn" or "anchor"
    std::string file{};
    std::uint64_t line = 0;  ///< from 1; 0: the end of what was read
    std::string text{};      ///< a clause for the user
};

/// What the log says of audits.
struct Anchors {
    bool is_read = false;  ///< a log was read, whatever it says
    /// Number and hash, or the beginning of the hash, of records in the log, by chain.
    std::map<std::string, std::map<std::uint64_t, std::string>, std::less<>> chains{};
    std::map<std::string, std::string, std::less<>> files{};  ///< of chains, where it is said
    std::uint64_t lost = 0;  ///< records that could not be written when a run ended
};
/// Adds what a line of the log says, of format text or json, whatever a collector has put before
/// it. Only the event itself counts: what clients send stands in quotes there. Pure.
void collect_anchor(std::string_view log_line, Anchors& anchors);

struct Report {
    std::uint64_t first = 0;  ///< number of the first record; 0: there was none
    std::uint64_t records = 0;
    std::uint64_t anchored = 0;  ///< anchors that were compared
    std::string chain{};         ///< its id; empty: it has none
    Position last{};
    std::optional<Fault> fault{};
    std::string unread{};  ///< "FILE: why" of a file that cannot be read
    /// What the records themselves say is missing: runs that did not end in order, torn lines,
    /// records for which there was no room. At most 1,000.
    std::vector<std::string> remarks{};
};

/// Reads the files of a chain, in the order of their records, up to the first line that is not the
/// record that follows. `all_of`: the files are all files of the audit that is written to this one,
/// so that what is missing before them was removed; empty: they may be some.
Report verify(std::vector<std::string> files, const Anchors& anchors = {},
              const std::string& all_of = {});

}  // namespace panelgate::audit
