#include "panelgate/mqtt/home_assistant.hpp"

#include <algorithm>
#include <array>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <cmath>
#include <utility>

#include "panelgate/web/http/json_text.hpp"

namespace panelgate::mqtt {

namespace json = boost::json;

namespace {

/// A unit as configured, as Home Assistant spells the unit, and the class of such values.
struct Unit {
    std::string_view typed;
    std::string_view shown;
    std::string_view device_class;
};
constexpr std::array<Unit, 14> kUnits{{{"celsius", "°C", "temperature"},
                                       {"°C", "°C", "temperature"},
                                       {"fahrenheit", "°F", "temperature"},
                                       {"percent", "%", ""},
                                       {"V", "V", "voltage"},
                                       {"A", "A", "current"},
                                       {"W", "W", "power"},
                                       {"kW", "kW", "power"},
                                       {"Wh", "Wh", "energy"},
                                       {"kWh", "kWh", "energy"},
                                       {"Hz", "Hz", "frequency"},
                                       {"bar", "bar", "pressure"},
                                       {"kPa", "kPa", "pressure"},
                                       {"Pa", "Pa", "pressure"}}};

constexpr std::string_view kBool = "{{ 'ON' if value_json.value else 'OFF' }}";
constexpr std::string_view kLabel = "{{ value_json.label | default(value_json.value) }}";
constexpr double kAnyNumber = 1e9;       // Home Assistant's own limits are 1 and 100
constexpr double kSmallestStep = 0.001;  // that Home Assistant takes

/// Ids of Home Assistant have letters, digits, '_' and '-'.
std::string id_of(std::string_view text) {
    std::string id(text);
    for (char& c : id) {
        const bool fits = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                          (c >= '0' && c <= '9') || c == '_' || c == '-';
        if (!fits) c = '_';
    }
    return id;
}

json::array availability_of(const Settings& settings, const std::string& state_topic) {
    return {json::object{{"topic", settings.topic + "/status"},
                         {"value_template", "{{ value_json.state }}"}},
            json::object{{"topic", state_topic},
                         {"value_template",
                          "{{ 'online' if value_json.quality == 'good' else 'offline' }}"}}};
}

void add_unit(json::object& component, const points::Point& point) {
    if (point.unit.empty()) return;
    const auto known = std::ranges::find(kUnits, point.unit, &Unit::typed);
    component["unit_of_measurement"] = known == kUnits.end() ? point.unit : known->shown;
    if (known != kUnits.end() && !known->device_class.empty())
        component["device_class"] = known->device_class;
}

void add_switch(json::object& component, bool writes) {
    component["p"] = writes ? "switch" : "binary_sensor";
    component["value_template"] = kBool;
    component["payload_on"] = writes ? "true" : "ON";
    component["payload_off"] = writes ? "false" : "OFF";
    if (!writes) return;
    component["state_on"] = "ON";
    component["state_off"] = "OFF";
}

/// What is chosen is a label; what is written is its raw number.
void add_select(json::object& component, const points::Point& point) {
    json::array options;
    json::object numbers;
    for (const auto& [raw, text] : point.labels) {
        options.push_back(json::value(text));
        numbers[text] = raw;
    }
    component["p"] = "select";
    component["options"] = std::move(options);
    component["value_template"] = kLabel;
    component["command_template"] = "{{ " + web::json_text(numbers) + "[value] }}";
}

void add_number(json::object& component, const points::Point& point) {
    component["p"] = "number";
    component["mode"] = "box";
    component["min"] = point.min ? point.min->nearest() : -kAnyNumber;
    component["max"] = point.max ? point.max->nearest() : kAnyNumber;
    const double step = points::is_integer(point.type) ? std::abs(point.scale) : 0;
    component["step"] = std::max(step, kSmallestStep);
    component["value_template"] = "{{ value_json.value }}";
    add_unit(component, point);
}

void add_sensor(json::object& component, const points::Point& point) {
    component["p"] = "sensor";
    component["value_template"] = point.labels.empty() ? "{{ value_json.value }}" : kLabel;
    if (point.type == points::Type::string || !point.labels.empty()) return;
    add_unit(component, point);
    const json::value* kind = component.if_contains("device_class");
    const bool counts_up = kind != nullptr && *kind == "energy";
    component["state_class"] = counts_up ? "total_increasing" : "measurement";
}

json::object component_of(const Settings& settings, const std::string& device,
                          std::string_view station, const points::Point& point) {
    const std::string topic = settings.topic + '/' + std::string(station) + '/' + point.name;
    const bool writes = settings.write && point.writable;
    const bool is_bool = point.bit || point.type == points::Type::boolean;
    json::object component{{"name", point.name},
                           {"unique_id", device + '_' + point.name},
                           {"state_topic", topic},
                           {"availability", availability_of(settings, topic)},
                           {"availability_mode", "all"}};
    if (is_bool)
        add_switch(component, writes);
    else if (writes && !point.labels.empty())
        add_select(component, point);
    else if (writes && point.type != points::Type::string)
        add_number(component, point);
    else
        add_sensor(component, point);
    if (writes && component.at("p") != "sensor") component["command_topic"] = topic + "/set";
    return component;
}

}  // namespace

Notice home_assistant_notice(const Settings& settings, const HomeStation& station) {
    const std::string device = id_of(settings.topic) + '_' + id_of(station.name);
    json::object components;
    for (const points::Point* point : station.points)
        components[point->name] = component_of(settings, device, station.name, *point);
    const json::object payload{{"dev",
                                {{"ids", json::array{device}},
                                 {"name", station.name},
                                 {"mf", "panelgate"},
                                 {"mdl", station.profile}}},
                               {"o", {{"name", "panelgate"}}},
                               {"cmps", std::move(components)},
                               {"qos", settings.qos}};
    return {"homeassistant/device/" + device + "/config", web::json_text(payload)};
}

std::string home_assistant_farewell(std::string_view before, std::string_view now) {
    const json::value former = json::parse(before);
    json::value told = json::parse(now);
    json::object& components = told.at("cmps").as_object();
    bool goes = false;
    for (const auto& [name, component] : former.at("cmps").as_object()) {
        const json::value* const stays = components.if_contains(name);
        if (stays != nullptr && stays->at("p") == component.at("p")) continue;
        components[name] = json::object{{"p", component.at("p")}};
        goes = true;
    }
    return goes ? web::json_text(told) : "";
}

}  // namespace panelgate::mqtt
