#include <utility>

#include "answer.hpp"
#include "handlers.hpp"
#include "patience.hpp"
#include "reading.hpp"
#include "station_path.hpp"
#include "view.hpp"

namespace panelgate::web {
namespace {

Handling read_items(HttpRequest request, Parsed<Items> items, const Api* api) {
    if (!items) co_return to_response(items.error());
    auto wording = wording_of(request);
    if (!wording) co_return to_response(wording.error());
    wording->count = items->span.count;
    const auto view = prepare_read(*items, *wording, api->providers.settings.max_transactions);
    if (!view) co_return to_response(view.error());
    const Duration deadline = api->directory->line_of(items->station).deadline;
    const Patience patience(request, deadline, api->providers.now);
    boost::asio::awaitable<Parsed<Reading>> reads =
        read_all(request.caller, &items->station, items->span, patience);
    Parsed<Reading> reading = co_await std::move(reads);
    if (!reading) co_return to_response(reading.error());
    co_return json_response(200, describe(*items, *view, *reading));
}

}  // namespace

Handling get_table(HttpRequest request, const Api* api) {
    auto items = items_of_table_path(request, *api->directory);
    return read_items(std::move(request), std::move(items), api);
}

Handling get_device(HttpRequest request, const Api* api) {
    auto items = items_of_device_path(request, *api->directory);
    return read_items(std::move(request), std::move(items), api);
}

}  // namespace panelgate::web
