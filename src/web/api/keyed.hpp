#pragma once

#include "handlers.hpp"
#include "panelgate/web/http/site.hpp"

namespace panelgate::web {

/// A write, once: with an Idempotency-Key (draft-ietf-httpapi-idempotency-key-header) that its
/// client has sent before it is not done again, and gets the answer that the first one got, or
/// would have got, where its client was gone by then. Only what may have changed something is
/// remembered.
Handling keyed(HttpRequest request, const Api* api, Handler handler);

}  // namespace panelgate::web
