#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "panelgate/web/http/message.hpp"
#include "routes.hpp"

namespace panelgate::web {

/// What a route's answers have in addition to its handler's answer.
struct RoutePolicy {
    bool asks = false;    ///< it asks lines: the answer lists its transactions
    bool once = false;    ///< a write: it accepts Idempotency-Key
    bool tagged = false;  ///< a status: it has an ETag
};

/// Runs the handler and applies the route's policy; packs the answer with gzip where that pays and
/// the client accepts it.
Handling conduct(HttpRequest request, const Api* api, Handler handler, RoutePolicy policy);

/// A weak validator (RFC 9110 8.8.1) of a body. It ignores what only time changes: members that end
/// in _ms, and `time`.
std::string tag_of(std::string_view body);
/// True if this If-None-Match names the tag (RFC 9110 13.1.2).
bool names_tag(std::string_view if_none_match, std::string_view tag);
/// Adds the ETag to the response. Returns true and sets status 304 if the client has this tag
/// already: the response then has no body.
bool add_etag(HttpResponse& response, std::string_view if_none_match, const std::string& tag);

}  // namespace panelgate::web
