#pragma once

#include <optional>
#include <string>

#include "commands.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/scan/report.hpp"

namespace panelgate::commands {

/// The outcome of a scan; without a result, stderr has the reason.
struct ScanOutcome {
    ExitCode code = kFine;
    std::optional<profile::Catalogue> profiles;
    std::optional<scan::Result> result;
    std::string cut_short;     ///< why it ended early; empty when it did not
    std::string device;        ///< as in a configuration
    std::string profiles_dir;  ///< likewise; empty: none was given
};

/// Scans with these options. kUnavailable with a result: the result is incomplete, or nothing was
/// found.
ScanOutcome search(const ScanOptions& options);
/// Prints further advice for the user on stderr.
void print_advice(const ScanOptions& options, const scan::Result& result);

/// The input of a line's first configuration.
struct Found {
    std::string device;        ///< an absolute path, or tcp://HOST:PORT
    std::string profiles_dir;  ///< an absolute path, or ""
    const scan::Result& result;
    const profile::Catalogue& profiles;
};

/// A configuration from a scan's result, with comments that explain it and examples of points that
/// only have to be uncommented. Complete and valid if a station was found (found_any()).
std::string starter_yaml(const Found& found);

}  // namespace panelgate::commands
