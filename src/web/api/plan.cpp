#include <algorithm>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <cstdint>
#include <string>
#include <utility>

#include "answer.hpp"
#include "body.hpp"
#include "handlers.hpp"
#include "panel_limits.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/profile/notation.hpp"
#include "panelgate/profile/translate.hpp"
#include "station_path.hpp"
#include "writing.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

/// The panel's own names of these items, one each; none where it has none.
json::array notations(const Items& items) {
    json::array names;
    if (items.station.unknown_panel) return names;
    for (unsigned i = 0; i < items.span.count; ++i) {
        const auto address = static_cast<std::uint16_t>(items.span.first + i);
        const bool within = items.area != nullptr && items.area->readable.contains(address, 1);
        names.emplace_back(
            within ? profile::format_notation(*items.area, address)
                   : profile::format_notation(*items.station.profile, items.span.table, address));
    }
    return names;
}

/// The frame as its panel gets it: what it lacks goes out as what does the same.
std::string frame_of(const StationEntry& station, Bytes pdu) {
    auto request = modbus::Request::make(std::move(pdu), modbus::QuantityCheck::wide);
    if (!request) return "";
    const auto translated = profile::translate(*station.profile, *request);
    const Bytes& sent = translated ? translated->pdu() : request->pdu();
    return upper_hex(modbus::encode_adu(station.id, sent, station.profile->crc_order), " ");
}

HttpResponse describe(const Items& items, Bytes pdu, unsigned requests) {
    json::object body;
    body["station"] = items.station.name;
    body["line"] = items.station.line;
    body["id"] = items.station.id;
    body["table"] = label(items.span.table);
    body["address"] = items.span.first;
    body["count"] = items.span.count;
    body["requests"] = requests;
    body["frame"] = frame_of(items.station, std::move(pdu));
    body["notations"] = notations(items);
    return json_response(200, body);
}

/// Of several requests that a long read takes, the first.
HttpResponse plan_of_read(Items items) {
    if (items.area != nullptr) {
        const auto range = check_range(items, items.area->readable, "readable");
        if (!range) return to_response(range.error());
        const auto table = table_to_read(items);
        if (!table) return to_response(table.error());
        items.span.table = *table;
    }
    const unsigned limit = items.station.profile->max_count(read_function(items.span.table));
    const unsigned requests = (items.span.count + limit - 1) / limit;
    items.span.count = std::min(items.span.count, limit);
    return describe(items, modbus::encode_read(items.span), requests);
}

HttpResponse plan_of_write(Items items, const std::string& values) {
    auto writable = made_writable(std::move(items));
    if (!writable) return to_response(writable.error());
    const auto body = parse_object("{\"values\":[" + values + "]}", {"values"});
    const auto writing = write_of(*writable, body);
    if (!writing) return to_response(writing.error());
    const modbus::Request& made = writing->request.request;
    writable->span.count = made.access().write->count;
    return describe(*writable, made.pdu(), 1);
}

/// What would go out; nothing does.
HttpResponse plan(const HttpRequest& request, Parsed<Items> items) {
    if (!items) return to_response(items.error());
    const auto values = request.query.find("values");
    if (values == request.query.end()) return plan_of_read(std::move(*items));
    return plan_of_write(std::move(*items), values->second);
}

}  // namespace

Handling get_table_plan(HttpRequest request, const Api* api) {
    co_return plan(request, items_of_table_path(request, *api->directory));
}

Handling get_device_plan(HttpRequest request, const Api* api) {
    co_return plan(request, items_of_device_path(request, *api->directory));
}

}  // namespace panelgate::web
