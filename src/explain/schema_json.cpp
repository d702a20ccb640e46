#include "panelgate/explain/schema_json.hpp"

#include <algorithm>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/config/describe.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::explain {

namespace {

namespace json = boost::json;
using config::KeyRule;
using config::KeyShape;
using Kind = KeyShape::Kind;

/// Scalars are read as written, so a text may look like a number.
constexpr std::string_view kDefinitions = R"({
    "variable": {"type": "string", "pattern": "\\$\\{"},
    "text": {"type": ["string", "number", "boolean"], "minLength": 1}
})";

json::object reference(std::string_view name) { return {{"$ref", "#/$defs/" + std::string(name)}}; }

json::array words_of(const std::vector<std::string>& words) {
    json::array made;
    for (const std::string& word : words) made.emplace_back(word);
    return made;
}

json::object integer_of(const KeyShape& shape) {
    return {{"type", "integer"}, {"minimum", shape.min}, {"maximum", shape.max}};
}

json::object number_of(const KeyShape& shape) {
    json::object made{{"type", "number"}};
    if (shape.least) made["minimum"] = *shape.least;
    if (shape.most) made["maximum"] = *shape.most;
    if (shape.never) made["not"] = json::object{{"const", *shape.never}};
    return made;
}

std::string duration_name(const KeyShape& shape) {
    return "duration-" + yaml::format_duration(shape.shortest) + '-' +
           yaml::format_duration(shape.longest);
}

/// The text schema of the key, or of the entries of its list or map.
json::object text_of(const KeyShape& shape) {
    if (shape.holds_integers && shape.max == 0) return {{"type", "integer"}};
    if (shape.holds_integers)
        return {{"type", "integer"}, {"minimum", shape.min}, {"maximum", shape.max}};
    if (shape.pattern.empty() && shape.longest_text == 0) return reference("text");
    json::object made{{"type", "string"}, {"minLength", 1}};
    if (shape.may_be_number) made["type"] = json::array{"string", "number", "boolean"};
    if (!shape.pattern.empty()) made["pattern"] = shape.pattern;
    if (shape.longest_text != 0) made["maxLength"] = shape.longest_text;
    return made;
}

/// The schema of a scalar, without the variable alternative.
json::object scalar_of(const KeyShape& shape) {
    switch (shape.kind) {
        case Kind::integer:
            return integer_of(shape);
        case Kind::number:
            return number_of(shape);
        case Kind::boolean:
            return {{"type", "boolean"}};
        case Kind::word:
            return {{"enum", words_of(shape.words)}};
        case Kind::duration:
            return reference(duration_name(shape));
        case Kind::text:
        case Kind::map:
        case Kind::list:
            break;
    }
    return text_of(shape);
}

json::object or_variable(json::object one) {
    return {{"anyOf", json::array{std::move(one), reference("variable")}}};
}

json::object any_of(const KeyShape& shape) {
    json::array choices{scalar_of(shape)};
    if (shape.kind != Kind::word && !shape.words.empty())
        choices.push_back(json::object{{"enum", words_of(shape.words)}});
    choices.push_back(reference("variable"));
    if (shape.may_be_null.value_or(false)) choices.push_back(json::object{{"type", "null"}});
    return {{"anyOf", std::move(choices)}};
}

/// The type of a map or a list.
json::value type_of(const KeyShape& shape, std::string_view type) {
    if (!shape.may_be_null.value_or(true)) return json::value(std::string(type));
    return json::array{json::value(std::string(type)), "null"};
}

json::object required(std::string_view key) {
    return {{"required", json::array{json::value(std::string(key))}}};
}

/// Matches if `key` has one of the words.
json::object has_word(std::string_view key, json::array words) {
    json::object made = required(key);
    made["properties"] = json::object{{key, json::object{{"enum", std::move(words)}}}};
    return made;
}

/// A missing key may come from a merge.
json::array or_merge(json::object one) { return {std::move(one), required("<<")}; }

json::value as_json(const KeyShape& shape, std::string_view written) {
    const bool plain =
        shape.kind == Kind::integer || shape.kind == Kind::number || shape.kind == Kind::boolean;
    return plain ? json::parse(json::string_view(written.data(), written.size()))
                 : json::value(std::string(written));
}

std::string description_of(const KeyShape& shape) {
    std::string text(shape.text);
    if (shape.kind == Kind::duration)
        text += (text.empty() ? "" : " ") + yaml::format_duration(shape.shortest) + " to " +
                yaml::format_duration(shape.longest) + '.';
    return text;
}

class Schema {
  public:
    Schema() : described_(config::describe()) {
        for (const KeyShape& shape : described_.keys) shapes_.emplace(shape.path, shape);
    }

    json::object whole() const {
        json::object top = map_at("");
        top["properties"].as_object()["templates"] = templates();
        top["patternProperties"] = json::object{{"^x-", true}};
        top["allOf"].as_array().push_back(serves());
        json::object made{{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                          {"title", "configuration of panelgate"},
                          {"$defs", definitions()}};
        for (auto& [key, value] : top) made[key] = std::move(value);
        made["type"] = "object";
        return made;
    }

  private:
    json::object definitions() const {
        json::object made = json::parse(kDefinitions).as_object();
        for (const auto& [path, shape] : shapes_) {
            if (shape.kind == Kind::duration)
                made[duration_name(shape)] = json::object{
                    {"type", "string"},
                    {"pattern", yaml::duration_pattern(shape.shortest, shape.longest)}};
        }
        return made;
    }

    static json::object serves() {
        json::array any;
        for (const std::string_view key : config::serving_keys()) {
            json::object one = required(key);
            const json::array nothing{nullptr, json::array{}};
            const json::object is_nothing{{"enum", nothing}};
            one["properties"] = json::object{{key, json::object{{"not", is_nothing}}}};
            any.push_back(std::move(one));
        }
        any.push_back(required("<<"));
        return {{"anyOf", std::move(any)}};
    }

    json::object as_schema(const KeyRule& rule) const {
        if (rule.needs)
            return {{"if", has_word(rule.key, words_of(rule.words))},
                    {"then", json::object{{"anyOf", or_merge(required(rule.other))}}}};
        std::vector<std::string> wrong;
        for (const std::string& word : shapes_.at(rule.map + '/' + rule.other).words) {
            if (std::ranges::find(rule.words, word) == rule.words.end()) wrong.push_back(word);
        }
        json::object is_wrong = has_word(rule.other, words_of(wrong));
        json::object right{{"not", std::move(is_wrong)}};
        if (!rule.absent_will_do) right["required"] = json::array{json::value(rule.other)};
        return {{"if", required(rule.key)},
                {"then", json::object{{"anyOf", or_merge(std::move(right))}}}};
    }

    /// The keys directly below a path; "" is the top.
    std::vector<const KeyShape*> below(std::string_view path) const {
        std::vector<const KeyShape*> found;
        const std::string start = path.empty() ? "" : std::string(path) + '/';
        for (const auto& [known, shape] : shapes_) {
            const bool inside = known.starts_with(start) && known.size() > start.size();
            if (inside && known.find('/', start.size()) == known.npos) found.push_back(&shape);
        }
        return found;
    }

    /// `part`: some keys of the map may be given elsewhere, so none of them is required.
    enum class Part : std::uint8_t { whole, some };
    json::object map_at(std::string_view path, Part part = Part::whole) const {
        json::object keys{{"<<", true}};
        json::array needed;
        for (const KeyShape* shape : below(path)) {
            const std::string key = shape->path.substr(shape->path.rfind('/') + 1);
            keys[key] = schema_of(*shape);
            if (shape->required) needed.emplace_back(key);
        }
        if (path == "lines/stations") keys["template"] = template_key();
        json::object made{{"type", json::array{"object", "null"}},
                          {"properties", std::move(keys)},
                          {"additionalProperties", false}};
        json::array all;
        if (!needed.empty() && part == Part::whole)
            all.push_back(
                json::object{{"anyOf", or_merge(json::object{{"required", std::move(needed)}})}});
        for (const KeyRule& rule : described_.rules) {
            if (rule.map == path) all.push_back(as_schema(rule));
        }
        if (!all.empty()) made["allOf"] = std::move(all);
        return made;
    }

    json::object map_of(const KeyShape& shape) const {
        json::object made = map_at(shape.path);
        made["type"] = type_of(shape, "object");
        if (!shape.keys.empty())
            made["patternProperties"] = json::object{{shape.keys, or_variable(text_of(shape))}};
        return made;
    }

    json::object list_of(const KeyShape& shape) const {
        const bool of_maps = !below(shape.path).empty();
        json::object item = of_maps ? map_at(shape.path) : or_variable(text_of(shape));
        if (of_maps) item["type"] = "object";
        if (shape.may_be_text)
            item = {{"anyOf", json::array{std::move(item), text_of(shape), reference("variable")}}};
        json::object made{{"type", type_of(shape, "array")}, {"items", std::move(item)}};
        if (shape.fewest != 0) made["minItems"] = shape.fewest;
        if (shape.most_entries != 0) made["maxItems"] = shape.most_entries;
        return made;
    }

    json::object schema_of(const KeyShape& shape) const {
        json::object made = shape.kind == Kind::map    ? map_of(shape)
                            : shape.kind == Kind::list ? list_of(shape)
                                                       : any_of(shape);
        if (shape.may_be_text && shape.kind != Kind::list)
            made = {{"anyOf", json::array{std::move(made), text_of(shape), reference("variable")}}};
        if (shape.may_be_pair)
            made = {{"anyOf", json::array{std::move(made), json::object{{"type", "array"},
                                                                        {"items", text_of(shape)},
                                                                        {"minItems", 2},
                                                                        {"maxItems", 2}}}}};
        const std::string text = description_of(shape);
        if (!text.empty()) made["description"] = text;
        if (!shape.initial.empty()) made["default"] = as_json(shape, shape.initial);
        return made;
    }

    json::object template_key() const {
        return {{"$ref", "#/$defs/text"},
                {"description", shapes_.at("lines/stations/template").text}};
    }

    json::object templates() const {
        json::object body = map_at("lines/stations", Part::some);
        body["type"] = "object";
        for (const char* key : {"id", "name", "template"})
            body["properties"].as_object().erase(key);
        return {{"type", json::array{"object", "null"}},
                {"properties", json::object{{"<<", true}}},
                {"patternProperties", json::object{{config::name_pattern(), std::move(body)}}},
                {"additionalProperties", false},
                {"description", shapes_.at("templates").text}};
    }

    const config::Described& described_;
    std::map<std::string, KeyShape> shapes_;
};

}  // namespace

json::object schema_json() { return Schema().whole(); }

}  // namespace panelgate::explain
