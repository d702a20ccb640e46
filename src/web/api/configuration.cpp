#include <boost/json/value.hpp>
#include <memory>
#include <string>
#include <utility>

#include "handlers.hpp"
#include "kept_answer.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "panelgate/web/http/problem.hpp"
#include "routes.hpp"

namespace panelgate::web {

/// What is configured is the same for all of one role, and made once: who asks is told what it may
/// do.
Handling get_configuration(HttpRequest request, const Api* api) {
    if (!api->providers.configuration)
        co_return to_response(problem(404, "this program shows no configuration"));
    std::shared_ptr<KeptAnswer>& kept = (*api->configuration)[request.role];
    if (!kept) {
        kept = std::make_shared<KeptAnswer>(
            "{\"version\":" + json_text(boost::json::value(api->providers.version)) +
                ",\"role\":" + json_text(boost::json::value(label(request.role))) +
                ",\"configuration\":" + *api->providers.configuration +
                ",\"rest\":" + json_text(offered()) + "}\n",
            "application/json");
    }
    Handling giving = KeptAnswer::give(kept, std::move(request));
    HttpResponse response = co_await std::move(giving);
    co_return response;
}

}  // namespace panelgate::web
