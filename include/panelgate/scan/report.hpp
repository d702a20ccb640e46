#pragma once

#include <string>
#include <vector>

#include "panelgate/scan/result.hpp"

namespace panelgate::scan {

/// The table: "DEVICE: 38400 8N1, 6 stations", then a row a station. `ending` is put behind the
/// first line in brackets when it is not empty.
std::string report_text(const std::string& device, const Result& result,
                        const std::string& ending = {});

/// The same as a configuration of one line, complete and valid when a station was found. `device`
/// is an absolute path or tcp://HOST:PORT; `profiles_dir`, when not empty, an absolute path.
std::string report_yaml(const std::string& device, const Result& result,
                        const std::string& profiles_dir = {});

/// The entries of these stations alone, for below the `stations:` of a line of that name.
std::string stations_yaml(const std::string& line, const std::vector<StationFinding>& stations);

/// What a station was taken for what it is by, and what is odd about it.
std::string evidence_text(const StationFinding& finding);

/// What a person should know or do besides: one sentence each.
std::vector<std::string> advice(const std::string& device, const Result& result);

/// A station gave a whole reply.
bool found_any(const Result& result);

}  // namespace panelgate::scan
