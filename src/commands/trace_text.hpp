#pragma once

#include <boost/json/object.hpp>
#include <map>
#include <string>
#include <vector>

namespace panelgate::commands {

/// Which transactions are wanted.
struct TraceFilter {
    unsigned station = 0;  ///< 0: every
    std::string name;      ///< of the station, as refusals name it
    bool errors = false;   ///< no good ones; an exception of the panel is one
};
/// A transaction or a refusal, for a terminal.
struct TraceLine {
    std::string time;  ///< RFC 3339: sorts
    std::string text;  ///< one line, with its end
};
/// What a page of GET /api/v1/lines/{line}/trace holds, oldest first. `names`: stations by id.
std::vector<TraceLine> trace_lines(const boost::json::object& page, const TraceFilter& filter,
                                   const std::map<unsigned, std::string>& names);
/// The headings over them.
std::string trace_heading();

/// A part of a report for support.
struct ReportPart {
    std::string name;
    std::string body;
    bool is_json = false;  ///< of the gateway as it is; otherwise a text
};
/// A report as JSON, without passwords in URLs. Parts of the same name make one of several: "a/b"
/// is the member b of a.
std::string report_text(const std::vector<ReportPart>& parts);

}  // namespace panelgate::commands
