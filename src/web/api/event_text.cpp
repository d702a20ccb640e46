#include "panelgate/web/api/event_text.hpp"

#include "panelgate/web/http/json_text.hpp"
#include "point_json.hpp"

namespace panelgate::web {
namespace json = boost::json;

std::string point_event(const bus::StationRef& station, const points::Point& point,
                        const points::PointReading& reading) {
    json::object object = point_json(point, reading);
    object["line"] = station.line;
    object["station"] = station.name;
    return json_text(object);
}

std::string line_event(std::string_view line, std::string_view state, std::string_view why) {
    json::object object{{"line", line}, {"state", state}};
    if (!why.empty()) object["why"] = why;
    return json_text(object);
}

std::string station_event(std::string_view line, std::string_view station, std::string_view what) {
    return json_text(json::object{{"line", line}, {"station", station}, {"event", what}});
}

std::string discovery_event(std::string_view line, std::string_view state, std::size_t asked,
                            std::size_t of, std::size_t found) {
    return json_text(json::object{
        {"line", line}, {"state", state}, {"asked", asked}, {"of", of}, {"found", found}});
}

std::string transaction_event(std::string_view line, std::string_view station,
                              std::uint8_t function, std::string_view outcome, Duration took) {
    json::object object{{"line", line},
                        {"station", nullptr},
                        {"function", function},
                        {"outcome", outcome},
                        {"duration_ms", to_milliseconds(took)}};
    if (!station.empty()) object["station"] = station;
    return json_text(object);
}

}  // namespace panelgate::web
