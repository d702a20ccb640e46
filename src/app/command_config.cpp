#include <algorithm>
#include <iostream>
#include <string>
#include <string_view>
#include <vector>

#include "commands.hpp"
#include "load.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/config/describe.hpp"
#include "panelgate/config/setting.hpp"
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
    std::vector<std::string_view> paths;
    for (const Setting& setting : all) paths.push_back(setting.path);
    const std::string near = nearest(path, paths);
    return near.empty() ? "; `panelgate config get` lists all"
                        : "; did you mean '" + shown_path(near) + "'?";
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

}  // namespace

ExitCode config_keys(const std::string& typed) {
    const std::string path = path_typed(typed);
    bool found = false;
    for (const yaml::KeyShape& shape : config::describe().keys) {
        if (!path.empty() && shape.path != path && !shape.path.starts_with(path + '/')) continue;
        found = true;
        std::cout << shown_path(shape.path);
        if (const std::string values = values_text(shape); !values.empty())
            std::cout << ": " << values;
        if (shape.required) std::cout << " (required)";
        if (!shape.initial.empty()) std::cout << " (default " << shape.initial << ')';
        std::cout << (shape.text.empty() ? "" : "\n    " + shape.text) << '\n';
    }
    if (found) return kFine;
    std::cerr << "panelgate: there is no key '" << typed
              << "'; `panelgate config keys` lists all\n";
    return kUsage;
}

ExitCode config_get(const std::string& file, const std::string& typed) {
    const Loaded loaded = load_file(file);
    if (!loaded.config) return loaded.code;
    const std::vector<Setting> all = config::all_settings(*loaded.config);
    const std::string path = path_typed(typed);
    const auto value = [](const Setting& setting) {
        return setting.secret ? std::string("(secret)") : setting.value;
    };
    bool found = false;
    for (const Setting& setting : all) {
        // An entry of a list has settings of its own, and no value.
        if (setting.value.empty() && !setting.secret) continue;
        const bool is_it = path_typed(setting.path) == path;
        const bool is_below = path.empty() || path_typed(setting.path).starts_with(path + '/');
        if (is_it) std::cout << value(setting) << '\n';
        if (!is_it && is_below)
            std::cout << shown_path(setting.path) << ": " << value(setting) << '\n';
        found = found || is_it || is_below;
    }
    if (found) return kFine;
    std::cerr << "panelgate: there is no setting '" << typed << '\'' << hint(all, path) << '\n';
    return kUsage;
}

}  // namespace panelgate::app
