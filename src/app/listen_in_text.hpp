#pragma once

#include <string>
#include <string_view>

namespace panelgate::app {

/// What stands behind `listen:` of the top-level `http:` in a text that is no YAML, as somebody is
/// about to change it; "" where none is found. By its lines, so it may be wrong where quotes,
/// anchors or comments are unusual. Pure.
std::string http_listen_in(std::string_view text);

}  // namespace panelgate::app
