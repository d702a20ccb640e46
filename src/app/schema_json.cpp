#include "schema_json.hpp"

#include <array>
#include <boost/json/array.hpp>
#include <boost/json/parse.hpp>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/config/describe.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::app {
namespace {

namespace json = boost::json;
using yaml::KeyShape;
using Kind = KeyShape::Kind;

/// What the loader looks at itself, where its reader knows no more than "a number" or "a map".
constexpr auto kFurther = std::to_array<std::pair<std::string_view, std::string_view>>({
    {"lines/serial/data_bits", R"({"enum": [7, 8]})"},
    {"serial_masters/serial/data_bits", R"({"enum": [7, 8]})"},
    {"lines/stations/points/labels",
     R"({"patternProperties": {"^-?[0-9]+$": {"$ref": "#/$defs/text"}}})"},
    {"lines/stations/points/no_value",
     R"({"items": {"anyOf": [{"type": "integer"}, {"$ref": "#/$defs/variable"}]}})"},
    {"modbus_tcp/units", R"({"patternProperties": {"^[0-9]{1,3}$": {"$ref": "#/$defs/text"}}})"},
    {"serial_masters/units",
     R"({"patternProperties": {"^[0-9]{1,3}$": {"$ref": "#/$defs/text"}}})"},
    {"modbus_tcp/diagnostics_unit", R"({"type": "null"})"},
});

/// Scalars are taken as they are written, so a text may look like a number.
constexpr std::string_view kDefinitions = R"({
    "variable": {"type": "string", "pattern": "\\$\\{"},
    "text": {"type": ["string", "number", "boolean"]},
    "duration": {"type": "string", "pattern": "^[0-9]+(us|ms|s|min)$|\\$\\{"}
})";

json::object reference(std::string_view name) { return {{"$ref", "#/$defs/" + std::string(name)}}; }

json::array words_of(const KeyShape& shape) {
    json::array words;
    for (const std::string& word : shape.words) words.emplace_back(word);
    return words;
}

json::object integer_of(const KeyShape& shape) {
    return {{"type", "integer"}, {"minimum", shape.min}, {"maximum", shape.max}};
}

/// What a scalar may be, besides a variable.
json::object scalar_of(const KeyShape& shape) {
    switch (shape.kind) {
        case Kind::integer:
            return integer_of(shape);
        case Kind::number:
            return {{"type", "number"}};
        case Kind::boolean:
            return {{"type", "boolean"}};
        case Kind::word:
            return {{"enum", words_of(shape)}};
        case Kind::duration:
            return reference("duration");
        case Kind::text:
        case Kind::map:
        case Kind::list:
            break;
    }
    return reference("text");
}

json::object any_of(const KeyShape& shape) {
    json::array choices{scalar_of(shape)};
    if (shape.kind != Kind::word && !shape.words.empty())
        choices.push_back(json::object{{"enum", words_of(shape)}});
    choices.push_back(reference("variable"));
    return {{"anyOf", std::move(choices)}};
}

json::value as_json(const KeyShape& shape, std::string_view written) {
    const bool plain =
        shape.kind == Kind::integer || shape.kind == Kind::number || shape.kind == Kind::boolean;
    return plain ? json::parse(json::string_view(written.data(), written.size()))
                 : json::value(std::string(written));
}

std::string description_of(const KeyShape& shape, const config::KeyText& told) {
    std::string text(told.text);
    if (shape.kind == Kind::duration)
        text += (text.empty() ? "" : " ") + yaml::format_duration(shape.shortest) + " to " +
                yaml::format_duration(shape.longest) + '.';
    return text;
}

class Schema {
  public:
    Schema() {
        for (const KeyShape& shape : config::describe()) shapes_.emplace(shape.path, shape);
        for (const config::KeyText& text : config::key_texts()) texts_.emplace(text.path, text);
    }

    json::object whole() const {
        json::object top = map_at("");
        json::object& keys = top["properties"].as_object();
        keys["templates"] = templates();
        top["patternProperties"] = json::object{{"^x-", true}};
        top["anyOf"] = with_merge(json::array{"lines"});
        json::object made{{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                          {"title", "configuration of panelgate"},
                          {"$defs", json::parse(kDefinitions)}};
        for (auto& [key, value] : top) made[key] = std::move(value);
        made["type"] = "object";
        return made;
    }

  private:
    /// The keys right below; "" is the top.
    std::vector<const KeyShape*> below(std::string_view path) const {
        std::vector<const KeyShape*> found;
        const std::string start = path.empty() ? "" : std::string(path) + '/';
        for (const auto& [known, shape] : shapes_) {
            const bool inside = known.starts_with(start) && known.size() > start.size();
            if (inside && known.find('/', start.size()) == known.npos) found.push_back(&shape);
        }
        return found;
    }

    json::object map_at(std::string_view path) const {
        json::object keys{{"<<", true}};
        json::array required;
        for (const KeyShape* shape : below(path)) {
            const std::string key = shape->path.substr(shape->path.rfind('/') + 1);
            keys[key] = schema_of(*shape);
            if (shape->required) required.emplace_back(key);
        }
        if (path == "lines/stations") keys["template"] = template_key();
        json::object made{{"type", json::array{"object", "null"}},
                          {"properties", std::move(keys)},
                          {"additionalProperties", false}};
        if (!required.empty()) made["anyOf"] = with_merge(std::move(required));
        return made;
    }

    /// What is missing may come from a merge.
    static json::array with_merge(json::array required) {
        return {json::object{{"required", std::move(required)}},
                json::object{{"required", json::array{"<<"}}}};
    }

    json::object list_at(const std::string& path) const {
        json::object item = map_at(path);
        const bool of_maps = !below(path).empty();
        if (of_maps) item["type"] = "object";
        return {{"type", json::array{"array", "null"}},
                {"items", of_maps ? item : reference("text")}};
    }

    json::object schema_of(const KeyShape& shape) const {
        json::object made = shape.kind == Kind::map    ? map_at(shape.path)
                            : shape.kind == Kind::list ? list_at(shape.path)
                                                       : any_of(shape);
        add_further(made, shape.path);
        const auto told = texts_.find(shape.path);
        if (told == texts_.end()) return made;
        const std::string text = description_of(shape, told->second);
        if (!text.empty()) made["description"] = text;
        const std::string_view otherwise = told->second.otherwise;
        if (!otherwise.empty()) made["default"] = as_json(shape, otherwise);
        return made;
    }

    static void add_further(json::object& made, std::string_view path) {
        for (const auto& [known, text] : kFurther) {
            if (known != path) continue;
            json::value further = json::parse(json::string_view(text.data(), text.size()));
            if (made.contains("anyOf")) {
                json::array& choices = made["anyOf"].as_array();
                if (further.as_object().contains("enum")) choices.erase(choices.begin());
                choices.push_back(std::move(further));
            } else {
                for (auto& [key, value] : further.as_object()) made[key] = value;
            }
        }
    }

    json::object template_key() const {
        return {{"$ref", "#/$defs/text"},
                {"description", texts_.at("lines/stations/template").text}};
    }

    json::object templates() const {
        json::object body = map_at("lines/stations");
        body.erase("anyOf");
        for (const char* key : {"id", "name", "template"})
            body["properties"].as_object().erase(key);
        return {{"type", json::array{"object", "null"}},
                {"additionalProperties", std::move(body)},
                {"description", texts_.at("templates").text}};
    }

    std::map<std::string, KeyShape> shapes_;
    std::map<std::string_view, config::KeyText> texts_;
};

}  // namespace

json::object schema_json() { return Schema().whole(); }

}  // namespace panelgate::app
