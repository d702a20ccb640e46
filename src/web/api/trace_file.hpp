#pragma once

#include <string>

#include "panelgate/web/http/message.hpp"

namespace panelgate::web {

/// An answer that is a capture, to be kept under this name.
HttpResponse pcapng_response(std::string body, const std::string& file_name);

}  // namespace panelgate::web
