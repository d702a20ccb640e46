#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

/// What is put into a text.
struct Insertion {
    std::size_t at = 0;  ///< offset in bytes
    std::string text;
    int line = 1;  ///< where the item begins in the longer text, from 1
};

/// Puts a map behind the last item of a list, in the style of the items before, so that every other
/// byte of the file stays as it is. `into`: keys, and names of items between: "relays",
/// "lines/floor1/stations". A missing list is begun where its map exists. Scalars of `item` are
/// texts if they are `quoted`, else numbers or booleans. Returns nothing, and adds to `problems`
/// why, if the text is no YAML, has no such place, or if the list is repeated by an alias.
std::optional<Insertion> insert(std::string_view text, std::string_view into, const Node& item,
                                Problems& problems);

}  // namespace panelgate::yaml
