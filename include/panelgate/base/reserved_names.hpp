#pragma once

#include <string_view>

namespace panelgate {

// What metrics and the log call stations by that have no name of their own: no station may be
// called so.

inline constexpr std::string_view kAllStations = "all";      ///< of a finding about a whole line
inline constexpr std::string_view kOtherStations = "other";  ///< those that nobody has listed

}  // namespace panelgate
