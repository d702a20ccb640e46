#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "panelgate/web/http/message.hpp"
#include "routes.hpp"

namespace panelgate::web {

/// What a route's answers have besides what its handler says.
struct Manner {
    /// Lines: it understands "Prefer: wait=N", and the answer names its transactions.
    bool asks = false;
    bool once = false;    ///< a write: it understands Idempotency-Key
    bool tagged = false;  ///< status: it has an ETag
};

/// The handler's answer, in that manner; packed (gzip) where that pays and the client takes it.
Handling conduct(HttpRequest request, const Api* api, Handler handler, Manner manner);

/// A weak validator (RFC 9110 8.8.1) of a body: it does not count what only time changes, the
/// members that end in _ms and `time`.
std::string tag_of(std::string_view body);
/// Does this If-None-Match name the tag? (RFC 9110 13.1.2)
bool names_tag(std::string_view if_none_match, std::string_view tag);
/// Gives the response its tag. True, and it is 304, for who has that already: no body belongs to
/// it then.
bool tell_tag(HttpResponse& response, std::string_view if_none_match, const std::string& tag);

}  // namespace panelgate::web
