#include "load.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "check_doors.hpp"
#include "load_roles.hpp"
#include "load_stations.hpp"
#include "loader.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/config/describe.hpp"
#include "panelgate/config/real_files.hpp"
#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/variables.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using yaml::Entry;
using yaml::Node;

std::optional<Node> take(Node& map, std::string_view key) {
    const auto found = std::ranges::find(map.entries, key, &Entry::key);
    if (found == map.entries.end()) return std::nullopt;
    Node value = std::move(found->value);
    map.entries.erase(found);
    return value;
}

/// Adds the keys that `map` does not have.
void add_missing(Node& map, const Node& from) {
    for (const Entry& entry : from.entries) {
        Node* own = map.find(entry.key);
        if (own == nullptr) {
            map.entries.push_back(entry);
        } else if (own->kind == Node::Kind::map && entry.value.kind == Node::Kind::map) {
            add_missing(*own, entry.value);
        }
    }
}

/// Repetitions by an alias keep the places of their keys.
using Place = std::pair<int, int>;
Place place_of(const Entry& entry) { return {entry.mark.line, entry.mark.column}; }

/// `lines` may be null.
template <class Do>
void for_stations(Node* lines, const Do& todo) {
    if (lines == nullptr) return;
    for (Node& line : lines->items) {
        Node* stations = line.find("stations");
        if (stations == nullptr) continue;
        for (Node& station : stations->items) todo(station);
    }
}

struct Template {
    yaml::Mark mark;
    Node body;
    yaml::Size size;
    bool used = false;
};

class Templates {
  public:
    explicit Templates(Loading& loading) : loading_(loading) {}

    void read(Node& list) {
        if (list.kind != Node::Kind::map && list.kind != Node::Kind::null) {
            loading_.problems.add(list.mark,
                                  "templates must be a map of stations by name, such as "
                                  "templates: {meter: {profile: generic}}");
        }
        move_bodies(list);
        for (Entry& entry : list.entries) read_one(entry);
    }

    void apply(Node& station) {
        const auto named = take(station, "template");
        if (!named) return;
        if (named->kind != Node::Kind::scalar) {
            loading_.problems.add(named->mark, "template must be the name of one of 'templates'");
            return;
        }
        const auto found = templates_.find(named->scalar);
        if (found == templates_.end()) {
            loading_.problems.add(named->mark, unknown(named->scalar));
            return;
        }
        found->second.used = true;
        const bool had_room = has_room();
        given_.nodes += found->second.size.nodes;
        given_.text += found->second.size.text;
        if (has_room()) {
            add_missing(station, found->second.body);
        } else if (had_room) {
            loading_.problems.add(named->mark,
                                  "templates give more than " + std::to_string(kMaxTemplateValues) +
                                      " values, or " + std::to_string(kMaxTemplateText >> 20U) +
                                      " MiB of text, to all stations together");
        }
    }

    /// A merge key in `lines` may have used part of them.
    std::vector<Node> take_unused(Node* lines) {
        std::set<Place> taken;
        for_stations(lines, [&](const Node& station) {
            for (const Entry& entry : station.entries) taken.insert(place_of(entry));
        });
        std::vector<Node> unused;
        for (auto& [name, one] : templates_) {
            const bool merged = std::ranges::any_of(one.body.entries, [&](const Entry& entry) {
                return taken.contains(place_of(entry));
            });
            if (one.used || merged) continue;
            loading_.warn(one.mark, "no station has template: " + name);
            if (one.body.kind == Node::Kind::map) unused.push_back(std::move(one.body));
        }
        return unused;
    }

  private:
    bool has_room() const {
        return given_.nodes <= kMaxTemplateValues && given_.text <= kMaxTemplateText;
    }
    /// Reports a station's keys that follow a name without a body, and takes them as that body.
    void move_bodies(Node& list) {
        const std::vector<std::string_view> keys = station_keys().names();
        std::vector<Entry> kept;
        for (Entry& entry : list.entries) {
            Entry* name = kept.empty() ? nullptr : &kept.back();
            const bool open = name != nullptr &&
                              (name->value.kind == Node::Kind::null || opened_.contains(name->key));
            if (!open || std::ranges::find(keys, entry.key) == keys.end()) {
                kept.push_back(std::move(entry));
                continue;
            }
            loading_.problems.add(entry.mark, "'" + entry.key + "' must be indented deeper than '" +
                                                  name->key + "' (line " +
                                                  std::to_string(name->mark.line) +
                                                  "), whose body it is: type 2 blanks before it");
            opened_.insert(name->key);
            name->value.kind = Node::Kind::map;
            name->value.entries.push_back(std::move(entry));
        }
        list.entries = std::move(kept);
    }

    void read_one(Entry& entry) {
        if (!is_name(entry.key))
            loading_.problems.add(entry.mark,
                                  "the name of a template must be of a-z, 0-9 and '-', "
                                  "not '" +
                                      entry.key + '\'');
        Node& body = entry.value;
        if (body.kind != Node::Kind::map)
            loading_.problems.add(body.mark,
                                  "a template must be a map of a station's keys, such as "
                                  "{profile: generic}");
        for (const std::string_view own : {"id", "name", "template"}) {
            const auto key = std::ranges::find(body.entries, own, &Entry::key);
            if (key == body.entries.end()) continue;
            loading_.problems.add(
                key->mark,
                "'" + std::string(own) + "' is a station's own: it cannot be in a template");
            body.entries.erase(key);
        }
        const yaml::Size size = yaml::size_of(body);
        templates_[entry.key] = {entry.mark, std::move(body), size, false};
    }

    std::string unknown(const std::string& typed) const {
        const std::string text = "there is no template '" + typed + '\'';
        if (templates_.empty())
            return text + "; add 'templates', such as templates: {" + typed +
                   ": {profile: generic}}";
        std::vector<std::string_view> names;
        for (const auto& [name, one] : templates_) names.push_back(name);
        return text + did_you_mean(typed, names, "templates");
    }

    Loading& loading_;
    std::map<std::string, Template> templates_;
    yaml::Size given_;
    std::set<std::string> opened_;  ///< names whose bodies are not indented
};

}  // namespace

std::vector<Node> apply_templates(Loading& loading, Node& tree) {
    Templates templates(loading);
    if (auto list = take(tree, "templates")) templates.read(*list);
    Node* lines = tree.find("lines");
    for_stations(lines, [&](Node& station) { templates.apply(station); });
    return templates.take_unused(lines);
}

namespace {

using yaml::MapReader;

constexpr std::string_view kNameLetters = "abcdefghijklmnopqrstuvwxyz0123456789-";

/// The shipped profiles; those of profiles_dir are added or replace them.
std::shared_ptr<const profile::Catalogue> load_profiles(Loading& loading, MapReader& root) {
    auto catalogue = std::make_shared<profile::Catalogue>(profile::Catalogue::shipped());
    const auto dir = root.text("profiles_dir");
    if (!dir) return catalogue;
    loading.config.profiles_dir = *dir;
    for (const std::string& fault :
         add_profiles(loading.path_of(*dir), loading.files, *catalogue, loading.problems)) {
        root.problem("profiles_dir", "profiles_dir: " + fault);
    }
    return catalogue;
}

/// Removes `x-` keys, where users may keep anchors.
void drop_extensions(yaml::Node& tree) {
    std::erase_if(tree.entries,
                  [](const yaml::Entry& entry) { return entry.key.starts_with("x-"); });
}

constexpr std::string_view kHttp = "did you mean 'http'? It serves REST, pages and metrics";

/// Keys that users write at the left margin.
constexpr std::array<yaml::Elsewhere, 21> kElsewhere{{{"rest", {}, {}, kHttp},
                                                      {"api", {}, {}, kHttp},
                                                      {"web", {}, {}, kHttp},
                                                      {"metrics", {}, {}, kHttp},
                                                      {"prometheus", {}, {}, kHttp},
                                                      {"level", "log", {}},
                                                      {"format", "log", {}},
                                                      {"listen", {}, "modbus_tcp or http"},
                                                      {"allow", {}, "modbus_tcp or http"},
                                                      {"units", {}, "modbus_tcp"},
                                                      {"tokens", {}, "http"},
                                                      {"anonymous", {}, "http"},
                                                      {"stations", {}, "a line, one of 'lines'"},
                                                      {"device", {}, "a line, one of 'lines'"},
                                                      {"serial", {}, "a line, one of 'lines'"},
                                                      {"baud", {}, "a line's serial"},
                                                      {"retries", {}, "a line or a station"},
                                                      {"echo", {}, "a line, one of 'lines'"},
                                                      {"rules", {}, "access"},
                                                      {"roles", {}, "access"},
                                                      {"points", {}, "a station"}}};

bool is_http(std::string_view key) {
    return std::ranges::any_of(kElsewhere, [key](const yaml::Elsewhere& place) {
        return place.key == key && place.instead == kHttp;
    });
}

constexpr std::array<std::string_view, 4> kServing{"modbus_tcp", "http", "serial_masters", "mqtt"};

bool serves(MapReader& root) {
    return std::ranges::any_of(kServing, [&](std::string_view key) {
        const yaml::Node* node = root.child(key);
        return node != nullptr &&
               (node->kind != yaml::Node::Kind::sequence || !node->items.empty());
    });
}

/// Lets holders of a station keep its profile: each reference owns the catalogue.
void keep_profiles(Config& config) {
    for (Line& line : config.lines) {
        for (Station& station : line.stations)
            station.profile = profile::ProfileRef(station.profile, config.profiles);
    }
}

/// Something must be served, unless a key is probably mistyped.
void check_servers(Loading& loading, MapReader& root, const yaml::Node& tree) {
    const bool mistyped = root.is_mistyped("modbus_tcp") || root.is_mistyped("http") ||
                          std::ranges::any_of(tree.entries, [](const yaml::Entry& entry) {
                              return is_http(entry.key);
                          });
    if (!serves(root) && !mistyped)
        loading.problems.add({1, 1},
                             "nothing to serve: add 'modbus_tcp' or 'http', such as modbus_tcp: "
                             "[{listen: 127.0.0.1:502}]");
}

void load_tree(Loading& loading, yaml::Node& tree) {
    yaml::resolve_merge_keys(tree, loading.problems);
    drop_extensions(tree);
    const std::vector<yaml::Node> unused = apply_templates(loading, tree);
    if (yaml::Description* description = loading.problems.description()) description->begin(tree);
    MapReader root(tree, loading.problems, "the configuration");
    if (tree.kind != yaml::Node::Kind::map) return;
    for (const std::string_view key : root_keys().names())
        loading.top_keys.push_back({key, {}, "the top level", {}, {}, tree.mark.column});
    loading.config.profiles = load_profiles(loading, root);
    load_lines(loading, root);
    keep_profiles(loading.config);
    for (const yaml::Node& body : unused) check_template(loading, body);
    load_own_roles(loading, root);
    load_modbus_tcp(loading, root);
    load_serial_masters(loading, root);
    load_http(loading, root);
    load_mqtt(loading, root);
    load_rules(loading, root);
    load_section(loading, root, "log", "{level: info}",
                 [&](MapReader& in) { log_keys().read(in, loading.config.log); });
    load_section(loading, root, "realtime", "{priority: 20, lock_memory: true}",
                 [&](MapReader& in) { realtime_keys().read(in, loading.config.realtime); });
    load_audit(loading, root);
    load_relays(loading, root);
    check_servers(loading, root, tree);
    root.elsewhere(kElsewhere);
    root.has("templates");  // known, though already resolved
    root_keys().read(root, loading.config);
    root.finish();
    if (loading.problems.empty() && loading.config.lines.empty()) refuse_no_lines(loading, root);
    if (loading.problems.empty()) warn_of_listeners(loading, tree);
}

/// Adds all of `unset` and those of `found` that do not merely follow from it (at the same place).
/// What many stations have from one template is reported once.
void tell(const yaml::Problems& unset, const yaml::Problems& found, yaml::Problems& problems) {
    std::set<std::pair<int, int>> silent;
    for (const yaml::Problem& problem : unset.list())
        silent.emplace(problem.mark.line, problem.mark.column);
    std::set<std::string> told;
    for (const yaml::Problems* some : {&unset, &found}) {
        yaml::Problems fresh(some->file());
        for (const yaml::Problem& problem : some->list()) {
            const bool follows = some == &found && problem.file == found.file() &&
                                 silent.contains({problem.mark.line, problem.mark.column});
            if (!follows && told.insert(yaml::format(problem)).second) fresh.add(problem);
        }
        problems.take(fresh);
    }
}

}  // namespace

std::span<const std::string_view> serving_keys() { return kServing; }

bool is_name(std::string_view text) {
    return !text.empty() && text.find_first_not_of(kNameLetters) == std::string_view::npos;
}

std::string pattern_of(std::string_view letters) {
    return '^' + ('[' + std::string(letters)) + "]+$";
}

std::string name_pattern() { return pattern_of(kNameLetters); }

std::optional<std::string> load_name(MapReader& in, bool required, const std::string& pattern) {
    auto name = required ? in.required_text("name") : in.text("name");
    in.looks_like("name", pattern, true);
    if (!name || is_name(*name)) return name;
    in.problem("name",
               "name must be of a-z, 0-9 and '-', not " + yaml::quote(*name) + name_hint(*name));
    return std::nullopt;
}

std::string load_unique_name(Loading& loading, MapReader& in, const std::string& what) {
    std::string name = load_name(in, true).value_or("");
    if (!name.empty())
        loading.firsts.once(in, "name", what + ' ' + name,
                            "there are two " + what + "s '" + name + '\'');
    return name;
}

std::string name_hint(std::string_view typed) {
    constexpr std::size_t kLongest = 40;
    std::string name;
    for (const char c : typed) {
        if (c < 0 || name.size() >= kLongest) return "";  // its ASCII letters are unknown
        const char lower = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
        const std::string one(1, c == ' ' || c == '_' || c == '.' ? '-' : lower);
        if (is_name(one)) name += one;
    }
    return name.empty() ? "" : "; write " + name;
}

std::optional<bool> load_read_only(MapReader& in) {
    const yaml::Node* access = in.child("access");
    if (access != nullptr && access->kind != yaml::Node::Kind::scalar) {
        in.problem("access",
                   "access here is read_write or read_only; rules by client and item are in the "
                   "top-level 'access'");
        return std::nullopt;
    }
    constexpr std::array<std::string_view, 2> kAccess{"read_write", "read_only"};
    const auto chosen = in.choice_index("access", kAccess);
    if (!chosen) return std::nullopt;
    return *chosen == 1;
}

std::optional<Config> load(std::string_view text, const Files& files, yaml::Problems& problems,
                           const yaml::Environment& environment) {
    yaml::Node tree = yaml::parse(text, problems);
    if (tree.kind == yaml::Node::Kind::null) {
        if (problems.empty())
            problems.add({1, 1}, "the file is empty; a configuration needs at least 'lines'");
        return std::nullopt;
    }
    drop_extensions(tree);  // before their content is checked
    yaml::Problems unset(problems.file());
    yaml::expand_variables(tree, environment, unset);
    refuse_control_characters(tree, unset);
    yaml::Problems found(problems.file());
    found.describe(problems.description());
    Config config;
    Loading loading{files, found, config, {}};
    load_tree(loading, tree);
    if (yaml::Description* description = problems.description()) description->forget();
    tell(unset, found, problems);
    if (!problems.empty()) return std::nullopt;
    apply_rules(config);
    return config;
}

}  // namespace panelgate::config
