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
#include "panelgate/base/text.hpp"
#include "panelgate/config/describe.hpp"
#include "panelgate/config/setting.hpp"
#include "panelgate/explain/load.hpp"
#include "panelgate/explain/schema_json.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::commands {
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

bool is_below(std::string_view path, std::string_view above) {
    return path.size() > above.size() && path.starts_with(above) && path[above.size()] == '/';
}

bool is_at_or_below(std::string_view path, std::string_view above) {
    return path == above || is_below(path, above);
}

/// A path whose entries of lists are looked up by their names.
class Walk {
  public:
    Walk(const std::vector<Setting>& all, const std::string& path) : all_(all), left_(path) {
        while (!left_.empty()) {
            if (names_) take_name();
            if (!left_.empty() && !names_) take_key();
        }
    }

    /// True if the path ends in a key, and the entries of the path exist.
    bool is_key() const { return is_key_ && list_.empty(); }
    /// "; write lines.NAME.retries, NAME being one of a, b"; "" where no name is missing.
    std::string hint() const {
        if (!is_key_ || list_.empty()) return "";
        std::string names;
        for (const Setting& setting : all_) {
            if (!is_below(setting.path, list_)) continue;
            const std::string name = setting.path.substr(list_.size() + 1);
            if (name.find('/') == name.npos) names += (names.empty() ? "" : ", ") + name;
        }
        return "; write " + shown_path(made_) + (names.empty() ? "" : ", with one of: " + names);
    }

  private:
    const config::KeyShape* key_named(std::string_view name) const {
        const std::string path = (key_ == nullptr ? "" : key_->path + '/') + std::string(name);
        return config::describe().find(path);
    }
    std::string_view next() const { return std::string_view(left_).substr(0, left_.find('/')); }
    void take(std::size_t size) { left_.erase(0, std::min(size + 1, left_.size())); }

    void take_name() {
        names_ = false;
        for (const Setting& setting : all_) {
            const std::string entry = path_typed(setting.path);
            if (!is_below(entry, made_)) continue;
            const std::string name = entry.substr(made_.size() + 1);
            if (!is_at_or_below(left_, name)) continue;
            made_ = entry;
            return take(name.size());
        }
        if (list_.empty()) list_ = made_;
        if (key_named(next()) == nullptr) take(next().size());
        made_ += "/NAME";
    }
    void take_key() {
        const config::KeyShape* found = key_named(next());
        is_key_ = found != nullptr || (key_ != nullptr && !key_->keys.empty());
        if (!is_key_) return left_.clear();
        made_ += (made_.empty() ? "" : "/") + std::string(next());
        take(next().size());
        key_ = found;
        names_ = key_ != nullptr && key_->kind == config::KeyShape::Kind::list && !left_.empty() &&
                 std::ranges::any_of(config::describe().keys, [&](const config::KeyShape& one) {
                     return is_below(one.path, key_->path);
                 });
    }

    const std::vector<Setting>& all_;
    std::string left_;
    std::string made_;
    std::string list_;  ///< the first one without an entry of that name
    const config::KeyShape* key_ = nullptr;
    bool names_ = false;
    bool is_key_ = false;
};

/// Says why there is no value, and returns the exit code.
ExitCode explain(const std::vector<Setting>& all, const std::string& typed) {
    const std::string path = path_typed(typed);
    const Walk walk(all, path);
    const std::string key = path.substr(path.rfind('/') + 1);
    if (walk.is_key() && (key == "template" || key == "templates")) {
        std::cerr << "panelgate: " << typed
                  << " is taken in when the file is read; its keys are shown at each station\n";
        return kNotSet;
    }
    if (walk.is_key()) {
        const config::Described& keys = config::describe();
        const auto at = std::ranges::find(
            all, path, [](const Setting& setting) { return path_typed(setting.path); });
        const bool idle = at != all.end() && !at->applies;
        std::cerr << "panelgate: " << typed << " is not set"
                  << (idle ? ": " + keys.condition_of(keys.of(*at)->path) : "") << '\n';
        return kNotSet;
    }
    std::vector<std::string_view> paths;
    for (const Setting& setting : all) paths.push_back(setting.path);
    std::string hint = walk.hint();
    if (const std::string near = hint.empty() ? nearest(path, paths) : ""; !near.empty())
        hint = "; did you mean '" + shown_path(near) + "'?";
    std::cerr << "panelgate: there is no setting '" << typed << '\''
              << (hint.empty() ? "; `panelgate config get` lists all" : hint) << '\n';
    return kUsage;
}

/// A file may hold any bytes; a terminal would obey some of them.
std::string printable(const std::string& value) {
    std::string text = as_utf8(value);
    std::ranges::replace_if(text, [](unsigned char c) { return c < ' ' || c == 0x7F; }, '?');
    return text;
}

/// As it is typed in a file: a text may need quotes.
std::string listed_value(const Setting& setting) {
    using Kind = config::KeyShape::Kind;
    const config::KeyShape* key = config::describe().of(setting);
    const bool is_text = key != nullptr && (key->kind == Kind::text || key->kind == Kind::map);
    return printable(is_text ? yaml::written(setting.value) : setting.value);
}

std::string words_text(const std::vector<std::string>& words) {
    std::string text;
    for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
    return text;
}

/// "1 to 4096", "10ms to 10min, or auto"; "" where anything goes.
std::string values_text(const config::KeyShape& shape) {
    using Kind = config::KeyShape::Kind;
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

void print(const config::KeyShape& key) {
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

boost::json::object to_json(const config::KeyShape& key) {
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

/// "; did you mean 'lines.timing'?" or "".
std::string nearest_key(const std::string& path) {
    std::vector<std::string_view> paths;
    for (const config::KeyShape& key : config::describe().keys) paths.push_back(key.path);
    const std::string near = nearest(path, paths);
    return near.empty() ? "" : "; did you mean '" + shown_path(near) + "'?";
}

}  // namespace

ExitCode schema() {
    std::cout << web::json_text(explain::schema_json()) << '\n';
    return kFine;
}

ExitCode config_keys(const std::string& typed, bool as_json) {
    const std::string path = path_typed(typed);
    std::vector<config::KeyShape> keys = config::describe().keys;
    std::erase_if(keys, [&](const config::KeyShape& key) {
        return !path.empty() && key.path != path && !key.path.starts_with(path + '/');
    });
    if (keys.empty()) {
        std::cerr << "panelgate: there is no key '" << typed << '\'' << nearest_key(path)
                  << "; `panelgate config keys` lists all\n";
        return kUsage;
    }
    if (as_json) {
        boost::json::array all;
        for (const config::KeyShape& key : keys) all.push_back(to_json(key));
        std::cout << web::json_text(boost::json::object{{"keys", std::move(all)}}) << '\n';
        return kFine;
    }
    for (const config::KeyShape& key : keys) print(key);
    return kFine;
}

ExitCode config_get(const std::string& file, const std::string& typed) {
    const explain::Loaded loaded = explain::load_file(file);
    if (!loaded.config) return loaded.code;
    const std::vector<Setting> all = config::all_settings(*loaded.config);
    const std::string path = path_typed(typed);
    bool found = false;
    for (const Setting& setting : all) {
        // An entry of a list has settings of its own, and no value.
        if (!setting.applies || (setting.value.empty() && !setting.secret)) continue;
        const std::string at = path_typed(setting.path);
        const bool is_it = at == path;
        const bool is_listed = !setting.secret && (path.empty() || is_below(at, path));
        if (is_it) std::cout << (setting.secret ? "(secret)" : printable(setting.value)) << '\n';
        if (is_listed)
            std::cout << printable(shown_path(setting.path)) << ": " << listed_value(setting)
                      << '\n';
        found = found || is_it || is_listed;
    }
    return found ? kFine : explain(all, typed);
}

}  // namespace panelgate::commands
