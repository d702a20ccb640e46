#include "panelgate/web/event_text.hpp"

#include <boost/json/serialize.hpp>

#include "json_util.hpp"
#include "point_json.hpp"

namespace panelgate::web {
namespace json = boost::json;

json::object point_json(const points::Point& point, const points::PointReading& reading) {
    json::object object;
    object["name"] = point.name;
    object["value"] = nullptr;
    if (reading.value)
        object["value"] = std::visit([](const auto& v) { return json::value(v); }, *reading.value);
    if (reading.label) object["label"] = *reading.label;
    object["unit"] = point.unit;
    object["quality"] = label(reading.quality);
    object["age_ms"] = nullptr;
    if (reading.age) {
        object["age_ms"] = whole_ms(*reading.age);
    }
    return object;
}

std::string point_event(const bus::StationRef& station, const points::Point& point,
                        const points::PointReading& reading) {
    json::object object = point_json(point, reading);
    object["line"] = station.line;
    object["station"] = station.name;
    return json::serialize(object);
}

std::string line_event(std::string_view line, std::string_view state, std::string_view why) {
    json::object object{{"line", line}, {"state", state}};
    if (!why.empty()) object["why"] = why;
    return json::serialize(object);
}

std::string station_event(std::string_view line, std::string_view station, std::string_view what) {
    return json::serialize(json::object{{"line", line}, {"station", station}, {"event", what}});
}

std::string transaction_event(std::string_view line, std::string_view station,
                              std::uint8_t function, std::string_view outcome, Duration took) {
    json::object object{{"line", line},
                        {"station", nullptr},
                        {"function", function},
                        {"outcome", outcome},
                        {"duration_ms", to_milliseconds(took)}};
    if (!station.empty()) object["station"] = station;
    return json::serialize(object);
}

}  // namespace panelgate::web
