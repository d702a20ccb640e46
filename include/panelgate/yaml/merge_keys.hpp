#pragma once

#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

/// Puts what a map takes over from others in the place of its merge key: `<<: *a`, or
/// `<<: [*a, *b]`. Its own keys win, then those of the map that is named first; nothing is merged
/// below them. What was taken over keeps its marks. (yaml.org/type/merge.html)
void resolve_merge_keys(Node& tree, Problems& problems);

}  // namespace panelgate::yaml
