#pragma once

#include <string>
#include <string_view>

namespace panelgate::web {

/// True if this Accept-Encoding allows gzip (RFC 9110 12.5.3; "" does not).
bool accepts_gzip(std::string_view accept_encoding);

/// Decompresses a body made by packed() or gzip(1); "" for anything else.
std::string unpacked(std::string_view body);

/// Compresses a body of less than 4 GiB to content coding gzip (RFC 1952). Pure.
std::string packed(std::string_view body);

}  // namespace panelgate::web
