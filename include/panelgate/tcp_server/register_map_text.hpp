#pragma once

#include <string>

namespace panelgate::tcp_server {

/// Returns a human-readable register map of the gateway's own unit, ending with a newline.
std::string describe_register_map();

}  // namespace panelgate::tcp_server
