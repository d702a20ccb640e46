#pragma once

#include <cstddef>

#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

/// What a value takes, with all that is in it.
struct Size {
    std::size_t nodes = 1;
    std::size_t text = 0;   ///< bytes of scalars and keys
    std::size_t depth = 0;  ///< levels of lists and maps
};

Size size_of(const Node& node);

}  // namespace panelgate::yaml
