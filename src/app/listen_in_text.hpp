#pragma once

#include <string>
#include <string_view>

namespace panelgate::app {

/// What stands behind `listen:` of the top-level `http:` in a text that is no YAML, as somebody is
/// about to change it; "" where none is found, or more than one. By its lines: braces over several
/// lines, anchors and the like are not understood. Pure.
std::string http_listen_in(std::string_view text);

}  // namespace panelgate::app
