#pragma once

#include <string>
#include <string_view>

#include "loader.hpp"
#include "panelgate/config/endpoint.hpp"

namespace panelgate::config {

std::string endpoint_pattern(bool port_may_lack);
void refuse_listen(Reader& in, std::string_view typed);

/// Reads `listen` into a listener's address and port.
template <class Settings>
bool read_listen(Reader& in, Settings& settings) {
    const auto text = in.text("listen");
    if (!text) return false;
    const auto endpoint = parse_endpoint(*text);
    if (!endpoint) return refuse_listen(in, *text), false;
    settings.address = endpoint->address;
    settings.port = endpoint->port;
    return true;
}

}  // namespace panelgate::config
