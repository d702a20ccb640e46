#pragma once

#include <cstddef>
#include <string>

#include "panelgate/base/time.hpp"

namespace panelgate::scan {

struct Progress {
    double share = 0;      ///< 0 to 1
    Duration remaining{};  ///< an estimate; while nothing has answered, at most this
    std::string what;      ///< "38400 8N1, station 17"
    std::size_t found = 0;
};

/// One line without its end, at most `width` characters wide.
std::string format_progress(const Progress& progress, std::size_t width);

}  // namespace panelgate::scan
