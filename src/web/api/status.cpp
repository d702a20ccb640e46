#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "answer.hpp"
#include "docs_page.hpp"
#include "handlers.hpp"
#include "kept_answer.hpp"
#include "panelgate/web/http/gzip.hpp"
#include "panelgate/web/http/problem.hpp"
#include "scrape.hpp"

namespace panelgate::web {
namespace {

HttpResponse text_response(unsigned status, std::string body,
                           std::string_view content_type = "text/plain; charset=utf-8") {
    HttpResponse response;
    response.status = status;
    response.content_type = content_type;
    response.body = std::move(body);
    return response;
}

}  // namespace

Handling get_openapi(HttpRequest request, const Api*) {
    static const auto kept = std::make_shared<KeptAnswer>(openapi_text(), "application/json");
    return KeptAnswer::give(kept, std::move(request));
}

Handling get_docs(HttpRequest request, const Api*) {
    static const auto kept = std::make_shared<KeptAnswer>(
        docs_page(boost::json::parse(openapi_text()).as_object()), "text/html; charset=utf-8");
    Handling giving = KeptAnswer::give(kept, std::move(request));
    HttpResponse response = co_await std::move(giving);
    response.headers.emplace_back("Content-Security-Policy", std::string(kDocsPolicy));
    co_return response;
}

Handling get_version(HttpRequest, const Api* api) {
    const Providers& providers = api->providers;
    boost::json::object libraries;
    for (const auto& [name, version] : providers.libraries) libraries[name] = version;
    boost::json::object body;
    body["version"] = providers.version;
    body["commit"] = providers.commit;
    body["compiler"] = providers.compiler;
    body["libraries"] = std::move(libraries);
    co_return json_response(200, body);
}

Handling get_healthz(HttpRequest, const Api*) { co_return text_response(200, "ok\n"); }

Handling get_readyz(HttpRequest, const Api* api) {
    if (api->providers.ready()) co_return text_response(200, "ready\n");
    const std::string missing = api->providers.missing();
    co_return text_response(503, missing.empty() ? "not ready\n" : "not ready: " + missing + '\n');
}

Handling get_metrics(HttpRequest request, const Api* api) {
    const bool gzip = accepts_gzip(request.headers["accept-encoding"]);
    boost::asio::awaitable<SharedText> making =
        scrape(request.caller, api->providers.metrics, gzip);
    SharedText text = co_await std::move(making);
    if (!text)
        co_return to_response(passing_problem(503, "the metrics cannot be made now; try again", 1));
    HttpResponse response = text_response(200, {}, api->providers.metrics_type);
    response.shared_body = std::move(text);
    response.headers.emplace_back("Vary", "Accept-Encoding");
    if (gzip) response.headers.emplace_back("Content-Encoding", "gzip");
    co_return response;
}

}  // namespace panelgate::web
