#pragma once

#include <string>

namespace panelgate::tcp_server {

/// The map of the gateway's own unit, for people; ends with a line break.
std::string describe_register_map();

}  // namespace panelgate::tcp_server
