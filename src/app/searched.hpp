#pragma once

#include <optional>
#include <string>

#include "commands.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/scan/result.hpp"

namespace panelgate::app {

/// What came of a scan; no result: stderr has said why.
struct Searched {
    ExitCode code = kFine;
    std::optional<profile::Catalogue> profiles;
    std::optional<scan::Result> result;
    std::string cut_short;     ///< why it ended early; empty when it did not
    std::string device;        ///< as a configuration names it
    std::string profiles_dir;  ///< the same; empty: none was given
};

/// Scans as the command line says. kUnavailable with a result: it is not complete, or nothing was
/// found.
Searched search(const ScanOptions& options);
/// On stderr, what a person should know or do besides.
void tell_advice(const ScanOptions& options, const scan::Result& result);

}  // namespace panelgate::app
