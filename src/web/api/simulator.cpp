#include <boost/json/object.hpp>
#include <map>

#include "answer.hpp"
#include "body.hpp"
#include "handlers.hpp"
#include "panelgate/web/http/client_log.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "station_path.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

Parsed<StationEntry> find_simulated(const Directory& directory, const std::string& name) {
    auto station = find_station(directory, name);
    if (station && !station->simulated)
        return problem(404, "station '" + name + "' is not simulated");
    return station;
}

/// Numbers, and true and false for 1 and 0.
Parsed<std::map<std::string, double>> numbers_of(const json::object& body) {
    std::map<std::string, double> numbers;
    for (const auto& [key, value] : body) {
        if (!value.is_number() && !value.is_bool())
            return problem(400, std::string(key) + " must be a number, true or false");
        numbers[key] = value.is_bool() ? (value.get_bool() ? 1 : 0) : value.to_number<double>();
    }
    return numbers;
}

HttpResponse faults_of(const StationEntry& station) {
    json::object faults;
    for (const auto& [name, value] : station.simulated->faults()) faults[name] = value;
    json::object body;
    body["station"] = station.name;
    body["faults"] = std::move(faults);
    return json_response(200, body);
}

}  // namespace

Handling get_simulated(HttpRequest request, const Api* api) {
    const auto station = find_simulated(*api->directory, request.arguments[0]);
    if (!station) co_return to_response(station.error());
    co_return faults_of(*station);
}

Handling put_simulated(HttpRequest request, const Api* api) {
    const auto station = find_simulated(*api->directory, request.arguments[0]);
    if (!station) co_return to_response(station.error());
    const auto body = parse_object(request.body);
    if (!body) co_return to_response(body.error());
    const auto numbers = numbers_of(*body);
    if (!numbers) co_return to_response(numbers.error());
    if (const auto wrong = station->simulated->set_faults(*numbers))
        co_return to_response(problem(400, *wrong));
    log_client(*request.caller, "simulator faults set",
               {{"station", station->name}, {"faults", json_text(*body)}});
    co_return faults_of(*station);
}

}  // namespace panelgate::web
