#pragma once

#include <string>
#include <vector>

#include "panelgate/web/http/message.hpp"

namespace panelgate::web {

/// Which pages of other sites may read: the server's part of the CORS protocol
/// (https://fetch.spec.whatwg.org/#http-cors-protocol). Pure.

/// The origin of the page that asks, as its browser wrote it, if `origins` (lower case) lists it;
/// else "".
std::string listed_origin(const HttpRequest& request, const std::vector<std::string>& origins);
bool is_listed(const std::string& origin, const std::vector<std::string>& origins);
/// True for what such a page may do: read, and ask beforehand whether it may.
bool is_reading(const HttpRequest& request);

/// Lets the browser hand a reply to the page of `origin`; `preflight`: it is one to OPTIONS.
void share_with(const std::string& origin, bool preflight, HttpResponse& response);

}  // namespace panelgate::web
