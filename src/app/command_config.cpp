#include <algorithm>
#include <array>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <cstddef>
#include <iostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "load.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/config/describe.hpp"
#include "panelgate/config/setting.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::app {
namespace {

using config::Setting;

/// A setting's path as it is typed: names are joined by '.' or '/'.
std::string path_typed(std::string text) {
    std::ranges::replace(text, '.', '/');
    return text;
}

std::string shown_path(std::string path) {
    std::ranges::replace(path, '/', '.');
    return path;
}

/// Returns "; did you mean 'lines.floor1.retries'?", or the names that come next.
std::string hint(const std::vector<Setting>& all, const std::string& path) {
    if (config::describe().is_key(path))
        return ": what it names is read when the file is, and only that is kept";
    std::vector<std::string_view> paths;
    for (const Setting& setting : all) paths.push_back(setting.path);
    const std::string near = nearest(path, paths);
    return near.empty() ? "; `panelgate config get` lists all"
                        : "; did you mean '" + shown_path(near) + "'?";
}

/// A file may hold any bytes; a terminal would obey some of them.
std::string printable(const std::string& value) {
    std::string text = as_utf8(value);
    std::ranges::replace_if(text, [](unsigned char c) { return c < ' ' || c == 0x7F; }, '?');
    return text;
}

std::string words_text(const std::vector<std::string>& words) {
    std::string text;
    for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
    return text;
}

/// "1 to 4096", "10ms to 10min, or auto"; "" where anything goes.
std::string values_text(const yaml::KeyShape& shape) {
    using Kind = yaml::KeyShape::Kind;
    if (shape.kind == Kind::boolean) return "true, false";
    if (shape.kind == Kind::word) return words_text(shape.words);
    std::string text;
    if (shape.kind == Kind::integer)
        text = std::to_string(shape.min) + " to " + std::to_string(shape.max);
    if (shape.kind == Kind::duration)
        text =
            yaml::format_duration(shape.shortest) + " to " + yaml::format_duration(shape.longest);
    if (shape.kind == Kind::number && shape.least && shape.most)
        text = number_text(*shape.least) + " to " + number_text(*shape.most);
    if (!shape.words.empty()) text += (text.empty() ? "" : ", or ") + words_text(shape.words);
    return text;
}

void print(const yaml::KeyShape& key) {
    std::cout << shown_path(key.path);
    if (const std::string values = values_text(key); !values.empty()) std::cout << ": " << values;
    if (key.required) std::cout << " (required)";
    if (!key.initial.empty()) std::cout << " (default " << key.initial << ')';
    if (const std::string condition = config::describe().condition_of(key.path); !condition.empty())
        std::cout << " (" << condition << ')';
    for (const std::string& line : {key.text, key.change.empty() ? "" : "Changed: " + key.change})
        if (!line.empty()) std::cout << "\n    " << line;
    std::cout << '\n';
}

boost::json::object to_json(const yaml::KeyShape& key) {
    constexpr std::array<const char*, 8> kKinds{"text",     "integer", "number", "boolean",
                                                "duration", "word",    "map",    "list"};
    boost::json::object made{{"path", shown_path(key.path)},
                             {"kind", kKinds[static_cast<std::size_t>(key.kind)]},
                             {"required", key.required},
                             {"order", key.order}};
    const auto add = [&made](const char* name, const std::string& value) {
        if (!value.empty()) made[name] = value;
    };
    add("values", values_text(key));
    add("default", key.initial);
    add("example", key.example);
    add("text", key.text);
    add("change", key.change);
    add("condition", config::describe().condition_of(key.path));
    return made;
}

}  // namespace

ExitCode config_keys(const std::string& typed, bool as_json) {
    const std::string path = path_typed(typed);
    std::vector<yaml::KeyShape> keys = config::describe().keys;
    std::erase_if(keys, [&](const yaml::KeyShape& key) {
        return !path.empty() && key.path != path && !key.path.starts_with(path + '/');
    });
    if (keys.empty()) {
        std::cerr << "panelgate: there is no key '" << typed
                  << "'; `panelgate config keys` lists all\n";
        return kUsage;
    }
    if (as_json) {
        boost::json::array all;
        for (const yaml::KeyShape& key : keys) all.push_back(to_json(key));
        std::cout << web::json_text(boost::json::object{{"keys", std::move(all)}}) << '\n';
        return kFine;
    }
    for (const yaml::KeyShape& key : keys) print(key);
    return kFine;
}

ExitCode config_get(const std::string& file, const std::string& typed) {
    const Loaded loaded = load_file(file);
    if (!loaded.config) return loaded.code;
    const std::vector<Setting> all = config::all_settings(*loaded.config);
    const std::string path = path_typed(typed);
    const auto value = [](const Setting& setting) {
        return setting.secret ? std::string("(secret)") : printable(setting.value);
    };
    bool found = false;
    for (const Setting& setting : all) {
        // An entry of a list has settings of its own, and no value.
        if (setting.value.empty() && !setting.secret) continue;
        const bool is_it = path_typed(setting.path) == path;
        const bool is_below = path.empty() || path_typed(setting.path).starts_with(path + '/');
        if (is_it) std::cout << value(setting) << '\n';
        if (!is_it && is_below)
            std::cout << printable(shown_path(setting.path)) << ": " << value(setting) << '\n';
        found = found || is_it || is_below;
    }
    if (found) return kFine;
    std::cerr << "panelgate: there is no setting '" << typed << '\'' << hint(all, path) << '\n';
    return kUsage;
}

}  // namespace panelgate::app
