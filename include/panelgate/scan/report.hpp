#pragma once

#include <string>
#include <vector>

#include "panelgate/scan/result.hpp"

namespace panelgate::scan {

/// Returns the table: "DEVICE: 38400 8N1, 6 stations", then a row per station. A non-empty `ending`
/// is added to the first line in parentheses.
std::string report_text(const std::string& device, const Result& result,
                        const std::string& ending = {});

/// The same as a configuration of one line, complete and valid if a station was found. `device` is
/// an absolute path or tcp://HOST:PORT; `profiles_dir` is empty or an absolute path.
std::string report_yaml(const std::string& device, const Result& result,
                        const std::string& profiles_dir = {});

/// Returns the entries of these stations only, for the `stations:` of the named line.
std::string stations_yaml(const std::string& line, const std::vector<StationFinding>& stations);

/// Returns why a station was recognised as such, and its anomalies.
std::string evidence_text(const StationFinding& finding);

/// Returns further advice for the user: one sentence each.
std::vector<std::string> advice(const std::string& device, const Result& result);

/// True if a station gave a complete reply.
bool found_any(const Result& result);

}  // namespace panelgate::scan
