#include <boost/json/array.hpp>

#include "api.hpp"
#include "items.hpp"
#include "json_util.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

json::object describe(const StationEntry& station) {
    const bus::StationStatus status = station.bus->station_status(station.id);
    json::object object;
    object["name"] = station.name;
    object["line"] = station.line;
    object["id"] = station.id;
    object["profile"] = nullptr;
    if (station.profile != nullptr) object["profile"] = station.profile->name;
    object["unit"] = nullptr;
    if (station.unit) object["unit"] = *station.unit;
    object["state"] = status.state;
    object["read_only"] = station.read_only;
    object["last_success_ms"] = nullptr;
    if (status.last_success) {
        object["last_success_ms"] =
            std::chrono::duration_cast<std::chrono::milliseconds>(*status.last_success).count();
    }
    return object;
}

}  // namespace

Handling get_stations(HttpRequest, const Api* api) {
    json::array stations;
    for (const StationEntry& station : api->directory->stations) {
        stations.push_back(describe(station));
    }
    json::object body;
    body["stations"] = std::move(stations);
    co_return json_response(200, body);
}

Handling get_station(HttpRequest request, const Api* api) {
    const auto station = find_station(*api, request.arguments[0]);
    if (!station) co_return to_response(station.error());
    co_return json_response(200, describe(*station));
}

}  // namespace panelgate::web
