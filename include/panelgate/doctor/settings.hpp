#pragma once

#include <cstddef>
#include <cstdint>

#include "panelgate/base/time.hpp"

namespace panelgate::doctor {

struct Settings {
    Duration window = 60s;  ///< what is looked at
    Duration step = 5s;     ///< the window moves on by this
    /// No new look before; a look costs a comparison of all stations' counts.
    Duration rest = 500ms;
    /// The window is longer when fewer attempts than this were in it.
    std::uint64_t attempts = 20;
    std::size_t marks = 64;  ///< instants that are remembered at most
};

}  // namespace panelgate::doctor
