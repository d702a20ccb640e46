#include <boost/asio/awaitable.hpp>
#include <cstdint>
#include <string>
#include <utility>

#include "accept.hpp"
#include "handlers.hpp"
#include "long_answer.hpp"
#include "panelgate/web/http/query.hpp"
#include "station_path.hpp"
#include "trace_json.hpp"
#include "trace_page.hpp"
#include "trace_text.hpp"

namespace panelgate::web {
namespace {

constexpr unsigned kDefaultTrace = 100;  ///< of each
constexpr unsigned kMaxTrace = 500;

/// The page that a query asks for.
Parsed<TracePage> page_of(const HttpRequest& request, const bus::BusClient& bus) {
    const auto since = request.query.find("since");
    const bool follows = since != request.query.end();
    const auto most =
        query_number(request, "last", 1, kMaxTrace, follows ? kMaxTrace : kDefaultTrace);
    if (!most) return most.error();
    if (!follows) return last_of_trace(bus, *most);
    const auto number = to_number<std::uint64_t>(since->second);
    if (!number) return problem(400, "since must be a sequence number: what `next` said, or 0");
    return trace_since(bus, *number, *most);
}

bool wants_text(const HttpRequest& request) {
    const auto accept = request.headers.find("accept");
    return accept != request.headers.end() && prefers(accept->second, "text/plain");
}

HttpResponse text_response(std::string body) {
    HttpResponse response;
    response.content_type = "text/plain; charset=utf-8";
    response.body = std::move(body);
    return response;
}

HttpResponse varied(HttpResponse response) {
    response.headers.emplace_back("Vary", "Accept");
    return response;
}

}  // namespace

Handling get_trace(HttpRequest request, const Api* api) {
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    const auto page = page_of(request, *(*line)->bus);
    if (!page) co_return to_response(page.error());
    if (wants_text(request)) co_return varied(text_response(trace_text(page->part)));
    LongAnswer body;
    boost::asio::awaitable<void> all = add_part(&body, &page->part);
    co_await std::move(all);
    body.member("next", page->next);
    co_return varied(body.response());
}

}  // namespace panelgate::web
