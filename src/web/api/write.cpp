#include <cstddef>
#include <string>
#include <utility>

#include "answer.hpp"
#include "body.hpp"
#include "handlers.hpp"
#include "panelgate/web/http/query.hpp"
#include "patience.hpp"
#include "station_path.hpp"
#include "writing.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

/// The query `round`.
Parsed<points::Rounding> rounding_of(const HttpRequest& request) {
    const auto round = query_flag(request, "round");
    if (!round) return round.error();
    return *round ? points::Rounding::nearest : points::Rounding::exact;
}

/// As the path names it: "press/points/setpoint".
HttpResponse refused(const HttpRequest& request, const Problem& why) {
    std::string at;
    for (std::size_t i = 3; i < request.path.size(); ++i)  // behind /api/v1/stations
        at += (at.empty() ? "" : "/") + request.path[i];
    log_refused(*request.caller, at, why);
    return to_response(why);
}

Handling carry_out(HttpRequest request, Parsed<Writing> writing, const Api* api) {
    if (!writing) co_return refused(request, writing.error());
    const Duration deadline = api->directory->line_of(writing->station).deadline;
    const Patience patience(request, deadline, api->providers.now);
    boost::asio::awaitable<Parsed<json::object>> writes =
        write(request.caller, &*writing, patience);
    const Parsed<json::object> told = co_await std::move(writes);
    if (!told) co_return to_response(told.error());
    co_return json_response(200, *told);
}

Handling put_items(HttpRequest request, Parsed<Items> items, const Api* api) {
    if (!items) co_return refused(request, items.error());
    auto writing = write_of(*items, parse_object(request.body, {"values", "value", "type", "order",
                                                                "length", "verify"}));
    boost::asio::awaitable<HttpResponse> done =
        carry_out(std::move(request), std::move(writing), api);
    co_return co_await std::move(done);
}

}  // namespace

Handling put_table(HttpRequest request, const Api* api) {
    auto items = items_of_table_path(request, *api->directory);
    return put_items(std::move(request), std::move(items), api);
}

Handling put_device(HttpRequest request, const Api* api) {
    auto items = made_writable(items_of_device_path(request, *api->directory));
    return put_items(std::move(request), std::move(items), api);
}

Handling put_point(HttpRequest request, const Api* api) {
    const auto to = find_point(*api->directory, request.arguments[0], request.arguments[1]);
    if (!to) co_return to_response(to.error());
    auto writing =
        write_of(*to, parse_object(request.body, {"value", "verify"}), rounding_of(request));
    boost::asio::awaitable<HttpResponse> done =
        carry_out(std::move(request), std::move(writing), api);
    co_return co_await std::move(done);
}

}  // namespace panelgate::web
