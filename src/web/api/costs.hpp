#pragma once

#include "handlers.hpp"
#include "panelgate/web/http/site.hpp"

namespace panelgate::web {

/// The handler's answer; where lines were asked for it, it names their transactions: "17, 18", or
/// "floor1:17, floor2:3" where they are of several lines (Panelgate-Transactions).
Handling costed(HttpRequest request, const Api* api, Handler handler);

}  // namespace panelgate::web
