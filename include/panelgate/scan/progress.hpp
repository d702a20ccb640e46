#pragma once

#include <cstddef>
#include <string>

#include "panelgate/base/time.hpp"

namespace panelgate::scan {

struct Progress {
    double share = 0;      ///< 0 to 1
    Duration remaining{};  ///< an estimate; an upper bound until a station has answered
    std::string what;      ///< "38400 8N1, station 17"
    std::size_t found = 0;
};

/// Returns one line without line end, at most `width` characters.
std::string format_progress(const Progress& progress, std::size_t width);

}  // namespace panelgate::scan
