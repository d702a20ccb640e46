#pragma once

#include <string_view>

namespace panelgate::web {

/// Does whoever sent this Accept take `type` rather than JSON? (RFC 9110 12.5.1; "" is no.)
bool prefers(std::string_view accept, std::string_view type);

}  // namespace panelgate::web
