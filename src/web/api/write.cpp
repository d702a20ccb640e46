#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include "answer.hpp"
#include "ask.hpp"
#include "body.hpp"
#include "handlers.hpp"
#include "refusal.hpp"
#include "station_path.hpp"
#include "write_plan.hpp"

namespace panelgate::web {
namespace {

Problem not_writable(modbus::Table table) {
    Problem made = problem(405, std::string(label(table)) + " cannot be written");
    made.headers.emplace_back("Allow", "GET, HEAD");
    return made;
}

/// The request that writes the body's values, or why there is none.
Parsed<bus::Request> write_request(const Items& items, std::string_view body) {
    if (!is_writable(items.span.table)) return not_writable(items.span.table);
    const auto cells = cells_of(body, items.span.table);
    if (!cells) return cells.error();
    auto pdu = plan_write(items, *cells);
    if (!pdu) return pdu.error();
    return request_to(items.station.id, std::move(*pdu));
}

Handling write_items(HttpRequest request, Parsed<Items> items) {
    if (!items) co_return to_response(items.error());
    auto planned =
        unless_refused(write_request(*items, request.body), *items->station.bus, items->station.id);
    if (!planned) co_return to_response(planned.error());
    bus::Request made = std::move(*planned);
    bus::Answer answer = co_await ask(request.caller, items->station.bus, std::move(made));
    co_return write_answer(answer, *items->station.profile);
}

/// A notation names memory: any table that reaches it and can be written will do.
Parsed<Items> device_to_write(const HttpRequest& request, const Directory& directory) {
    auto items = items_of_device_path(request, directory);
    if (!items) return items;
    const auto& also = items->area->also;
    const auto writable = std::ranges::find_if(also, is_writable);
    if (!is_writable(items->span.table) && writable != also.end()) items->span.table = *writable;
    if (is_writable(items->span.table) && !items->area->writable) {
        return ruled_out(bus::Rule::write_protected,
                         items->area->name + " is read-only in this panel");
    }
    return items;
}

}  // namespace

Handling put_table(HttpRequest request, const Api* api) {
    auto items = items_of_table_path(request, *api->directory);
    return write_items(std::move(request), std::move(items));
}

Handling put_device(HttpRequest request, const Api* api) {
    auto items = device_to_write(request, *api->directory);
    return write_items(std::move(request), std::move(items));
}

}  // namespace panelgate::web
