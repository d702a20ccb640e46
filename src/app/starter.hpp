#pragma once

#include <string>

#include "panelgate/profile/load_profile.hpp"
#include "panelgate/scan/report.hpp"

namespace panelgate::app {

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

}  // namespace panelgate::app
