#include <algorithm>

#include "api.hpp"
#include "bus_request.hpp"
#include "items.hpp"
#include "json_util.hpp"
#include "panelgate/modbus/exception.hpp"
#include "write_answer.hpp"
#include "write_plan.hpp"

namespace panelgate::web {
namespace {

Problem not_writable(const Items& items) {
    Problem made = problem(405, std::string(label(items.span.table)) + " cannot be written");
    made.headers.emplace_back("Allow", "GET, HEAD");
    return made;
}

/// The PDU for these values, or why the panel cannot take them.
Parsed<Bytes> plan_write(const Items& items, const std::vector<std::uint16_t>& cells) {
    for (const std::uint8_t function : write_functions(items.span.table, cells.size())) {
        if (!has_function(items.station, function)) continue;
        const unsigned limit = max_count(items.station, function);
        if (cells.size() > limit) {
            return problem(422, "at most " + std::to_string(limit) +
                                    " values in one write; writes are not split");
        }
        return encode_write(function, items.address(), cells);
    }
    const auto functions = write_functions(items.span.table, cells.size());
    return problem(422, "the panel has no function " + upper_hex({&functions.back(), 1}) + " for " +
                            std::to_string(cells.size()) + " of its " +
                            std::string(label(items.span.table)));
}

Parsed<bus::Request> write_request(const HttpRequest& request, Items items) {
    if (items.station.read_only) {
        return problem(403, "station '" + items.station.name + "' is read-only");
    }
    if (!is_writable(items.span.table)) return not_writable(items);
    const auto body = parse_object(request.body);
    if (!body) return body.error();
    const auto cells = values_member(*body, items.span.table);
    if (!cells) return cells.error();
    if (cells->size() > modbus::kTableItems - items.span.first) {
        return problem(422, "these values go beyond address 65535");
    }
    items.span.count = static_cast<unsigned>(cells->size());
    if (items.area != nullptr) {
        const auto range = check_range(items, *items.area->writable, "writable");
        if (!range) return range.error();
    }
    auto pdu = plan_write(items, *cells);
    if (!pdu) return pdu.error();
    return request_to(items.station.id, std::move(*pdu));
}

Handling write_items(HttpRequest request, Items items) {
    auto planned = write_request(request, items);
    if (!planned) co_return to_response(planned.error());
    bus::Request made = std::move(*planned);
    bus::Answer answer = co_await transact(request.caller, items.station.bus, std::move(made));
    co_return write_answer(answer, items.station.profile);
}

}  // namespace

HttpResponse write_answer(const bus::Answer& answer, const profile::PanelProfile* profile) {
    if (!answer.pdu) return to_response(problem_of(answer.pdu.error(), answer.transmitted));
    if (const auto code = modbus::exception_of(*answer.pdu)) {
        return to_response(problem_of_exception(*code, meaning_of(profile, *code)));
    }
    boost::json::object body;
    body["transmitted"] = true;
    body["confirmed"] = true;
    return json_response(200, body);
}

Handling put_table(HttpRequest request, const Api* api) {
    auto items = items_of_table_path(request, *api);
    if (!items) co_return to_response(items.error());
    Handling writing = write_items(std::move(request), std::move(*items));
    HttpResponse response = co_await std::move(writing);
    co_return response;
}

Handling put_device(HttpRequest request, const Api* api) {
    auto items = items_of_device_path(request, *api);
    if (!items) co_return to_response(items.error());
    const auto& also = items->area->also;
    const auto writable = std::ranges::find_if(also, is_writable);
    if (!is_writable(items->span.table) && writable != also.end()) items->span.table = *writable;
    if (is_writable(items->span.table) && !items->area->writable) {
        co_return to_response(problem(422, items->area->name + " is read-only in this panel"));
    }
    Handling writing = write_items(std::move(request), std::move(*items));
    HttpResponse response = co_await std::move(writing);
    co_return response;
}

}  // namespace panelgate::web
