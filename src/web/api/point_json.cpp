#include "point_json.hpp"

#include <variant>

#include "answer.hpp"
#include "panelgate/base/decimal.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::web {
namespace json = boost::json;

namespace {

struct Maker {
    json::value operator()(const auto& value) const { return json::value(value); }
    json::value operator()(const Decimal& value) const { return exact_number(value.text()); }
};

}  // namespace

json::value json_of(const points::Value& value) { return std::visit(Maker(), value); }

json::object point_json(const points::Point& point, const points::PointReading& reading) {
    json::object object;
    object["name"] = point.name;
    object["value"] = nullptr;
    if (reading.value) object["value"] = json_of(*reading.value);
    if (reading.label) object["label"] = *reading.label;
    object["unit"] = point.unit;
    object["quality"] = label(reading.quality);
    object["age_ms"] = nullptr;
    if (reading.age) {
        object["age_ms"] = whole_ms(*reading.age);
    }
    return object;
}

}  // namespace panelgate::web
