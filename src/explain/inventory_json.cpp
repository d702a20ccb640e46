#include <boost/json/array.hpp>
#include <boost/json/parse.hpp>
#include <charconv>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/config/deadlines.hpp"
#include "panelgate/config/describe.hpp"
#include "panelgate/explain/inventory.hpp"
#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/map_reader.hpp"
#include "setting_tree.hpp"

namespace panelgate::explain {
namespace {

namespace json = boost::json;
using KeyKind = config::KeyShape::Kind;

/// Whole milliseconds as an integer.
json::value milliseconds(Duration duration) {
    const auto whole = std::chrono::duration_cast<std::chrono::milliseconds>(duration);
    if (whole == duration) return static_cast<std::int64_t>(whole.count());
    return 1000 * to_seconds(duration);
}

/// A text that is no number, such as "auto", stays one.
template <class Number>
json::value number(const std::string& text) {
    Number made{};
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, made);
    if (error == std::errc() && stop == end) return made;
    return text == "null" ? json::value(nullptr) : json::value(text);
}

json::value list_json(const std::string& text, const config::KeyShape& key) {
    json::array made;
    for (const std::string& item : list_items(text))
        made.push_back(key.holds_integers ? number<std::int64_t>(item) : json::value(item));
    return made;
}

json::value value_json(const std::string& value, const config::KeyShape* key) {
    if (key == nullptr) return json::value(value);
    switch (key->kind) {
        case KeyKind::integer:
            return number<std::int64_t>(value);
        case KeyKind::number:
            return number<double>(value);
        case KeyKind::boolean:
            return value == "true";
        case KeyKind::duration: {
            const auto duration = yaml::parse_duration(value);
            return duration ? milliseconds(*duration) : json::value(value);
        }
        case KeyKind::list:
            return list_json(value, *key);
        case KeyKind::text:
        case KeyKind::word:
        case KeyKind::map:
            break;
    }
    return json::value(value);
}

/// Lines and masters say in one text what `serial` is.
std::string_view name_of(const SettingTree& map) {
    return map.key() == "serial" ? "serial_format" : map.key();
}

/// Members that are present without a setting, because a member of a release stays, with its type
/// (docs/operate/versions.md).
void add_lasting(json::object& made, std::string_view keys) {
    static const json::value kLasting = json::parse(R"({
        "": {"lines": [], "relays": [], "modbus_tcp": []},
        "lines": {"stations": []},
        "lines/stations": {"points": []},
        "modbus_tcp": {"lines": [], "units": {}, "diagnostics_unit": null, "allow": [], "tls": null},
        "modbus_tcp/tls": {"role_from": ""},
        "serial_masters": {"lines": [], "units": {}},
        "http": {"tokens": [], "hosts": [], "allow": [], "tls": null},
        "http/tls": {"role_from": ""},
        "mqtt": {"topic": ""}
    })");
    const json::value* here = kLasting.as_object().if_contains(keys);
    if (here == nullptr) return;
    for (const auto& [key, value] : here->as_object()) made.insert({{key, value}});
}

json::object object_of(const SettingTree& tree) {
    json::object made;
    for (const config::Setting* setting : tree.settings) {
        if (setting->secret || !setting->applies || setting->value.empty()) continue;
        const config::KeyShape* key = config::describe().of(*setting);
        const bool is_time = key != nullptr && key->kind == KeyKind::duration;
        made[std::string(setting->key()) + (is_time ? "_ms" : "")] =
            value_json(setting->value, key);
    }
    for (const auto& one : tree.below) {
        json::value& at = made[name_of(*one)];
        if (!one->map->in_list) {
            at = object_of(*one);
            continue;
        }
        if (!at.is_array()) at.emplace_array();
        at.as_array().push_back(object_of(*one));
    }
    add_lasting(made, tree.keys());
    return made;
}

/// Lists go on where an earlier part has begun them.
void append(json::object& all, json::object part) {
    for (auto& [key, value] : part) {
        json::value& at = all[key];
        if (at.is_null()) {
            at = std::move(value);
        } else {
            for (json::value& one : value.as_array()) at.as_array().push_back(std::move(one));
        }
    }
}

json::object clients_json(const config::Line& line) {
    const config::ClientTimeout client = config::client_timeout(line);
    json::object made{{"answered_within_ms", milliseconds(client.worst)}};
    if (!client.quick) return made;
    json::object quick{{"deadline_ms", milliseconds(client.quick->deadline)},
                       {"response_timeout_ms", milliseconds(client.quick->response_timeout)},
                       {"retries", client.quick->retries}};
    if (client.quick->most_registers) quick["most_registers"] = *client.quick->most_registers;
    made["within_500_ms"] = std::move(quick);
    return made;
}

json::array polls_json(const config::Line& line) {
    json::array polls;
    for (const config::Station& station : line.stations) {
        for (const points::Poll& poll : station.polls) {
            polls.push_back(json::object{{"station", station.name},
                                         {"read", poll.read},
                                         {"count", poll.count},
                                         {"every_ms", milliseconds(poll.every)}});
        }
    }
    return polls;
}

}  // namespace

json::object inventory_json(const config::Config& config) {
    json::object made;
    config::each_part(config, [&made](const std::vector<config::Setting>& part) {
        append(made, object_of(tree_of(part)));
    });
    for (std::size_t i = 0; i < config.lines.size(); ++i) {
        json::object& line = made["lines"].as_array()[i].as_object();
        line["serial"] = to_string(config.lines[i].device.serial);
        line["clients"] = clients_json(config.lines[i]);
        line["polls"] = polls_json(config.lines[i]);
    }
    for (std::size_t i = 0; i < config.serial_masters.size(); ++i)
        made["serial_masters"].as_array()[i].as_object()["serial"] =
            to_string(config.serial_masters[i].device.serial);
    return made;
}

}  // namespace panelgate::explain
