// A configuration as a whole: templates, the rows of the file, and what is served.

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/variables.hpp"
#include "tables.hpp"
#include "templates.hpp"

namespace panelgate::config {

bool load_mqtt(Reader& root, Config& config);

namespace {

using yaml::Entry;
using yaml::Node;

constexpr std::string_view kNameLetters = "abcdefghijklmnopqrstuvwxyz0123456789-";

/// Removes `x-` keys, where users may keep anchors.
void drop_extensions(yaml::Node& tree) {
    std::erase_if(tree.entries,
                  [](const yaml::Entry& entry) { return entry.key.starts_with("x-"); });
}

constexpr std::string_view kHttp = "did you mean 'http'? It serves REST, pages and metrics";

/// Keys that users write at the left margin.
constexpr std::array<yaml::Elsewhere, 21> kTopElsewhere{{{"rest", {}, {}, kHttp},
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
    return std::ranges::any_of(kTopElsewhere, [key](const yaml::Elsewhere& place) {
        return place.key == key && place.instead == kHttp;
    });
}

constexpr std::array<std::string_view, 4> kServing{"modbus_tcp", "http", "serial_masters", "mqtt"};

bool serves(Reader& root) {
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
void check_servers(Reader& root, const Node& tree) {
    const bool mistyped = root.is_mistyped("modbus_tcp") || root.is_mistyped("http") ||
                          std::ranges::any_of(tree.entries, [](const yaml::Entry& entry) {
                              return is_http(entry.key);
                          });
    if (!serves(root) && !mistyped)
        root.problems().add({1, 1},
                            "nothing to serve: add 'modbus_tcp' or 'http', such as modbus_tcp: "
                            "[{listen: 127.0.0.1:502}]");
}

// The rows of the file

/// The shipped profiles; those of profiles_dir are added or replace them.
bool read_profiles(Reader& root, Config& config) {
    auto catalogue = std::make_shared<profile::Catalogue>(profile::Catalogue::shipped());
    if (const auto dir = root.text("profiles_dir")) {
        config.profiles_dir = *dir;
        for (const std::string& fault : add_profiles(root.loading.path_of(*dir), root.loading.files,
                                                     *catalogue, root.problems()))
            root.problem("profiles_dir", "profiles_dir: " + fault);
    }
    config.profiles = std::move(catalogue);
    return root.has("profiles_dir");
}

constexpr std::string_view kLineListExample = "[{name: floor1, device: /dev/ttyUSB0}]";

void refuse_no_lines(Reader& root) {
    root.problems().add(root.mark("lines"),
                        "a configuration needs at least one line in 'lines', such as lines: " +
                            std::string(kLineListExample));
}

/// Missing lines are reported, unless a key is probably a mistyped `lines`.
bool read_lines(Reader& root, Config& config) {
    const Node* list = root.sequence("lines", kLineListExample);
    if (list == nullptr && root.is_mistyped("lines")) return false;
    root.loading.names_missing = list == nullptr && root.child("lines") != nullptr;
    if (root.loading.names_missing) return false;
    if (list == nullptr || list->items.empty()) return refuse_no_lines(root), false;
    for (const Node& node : list->items)
        if (auto line = load_line(root, node)) config.lines.push_back(std::move(*line));
    return true;
}

const Keys<rt::LogSettings>& log_keys() {
    using Log = rt::LogSettings;
    static constexpr Words<rt::LogLevel, 5> kLevels{{{"error", rt::LogLevel::error},
                                                     {"warn", rt::LogLevel::warn},
                                                     {"info", rt::LogLevel::info},
                                                     {"debug", rt::LogLevel::debug},
                                                     {"trace", rt::LogLevel::trace}}};
    static constexpr Words<rt::LogFormat, 2> kFormats{
        {{"text", rt::LogFormat::text}, {"json", rt::LogFormat::json}}};
    static const auto kKeys =
        Keys<Log>()
            .word("level", &Log::level, kLevels, "Lowest severity that is logged.")
            .example("info")
            .word("format", &Log::format, kFormats, "text for people, json for programs.");
    return kKeys;
}

const Keys<rt::RealtimeSettings>& realtime_keys() {
    using Realtime = rt::RealtimeSettings;
    static const auto kKeys =
        Keys<Realtime>()
            .integer("priority", &Realtime::priority, 0, 99,
                     "Priority of SCHED_FIFO, which needs CAP_SYS_NICE; 0: none.")
            .example("20")
            .boolean("lock_memory", &Realtime::lock_memory,
                     "Keeps all memory in RAM (mlockall), which needs CAP_IPC_LOCK.");
    return kKeys;
}

/// A section that a file may leave out: its map is read into the member that then exists.
template <class T, class U>
auto optional_section(std::string_view key, std::string_view example,
                      std::optional<T> Config::* member, const Keys<T, U>& (*table)(),
                      void (*check)(Reader&, T&) = nullptr) {
    return [=](Reader& root, Config& config) {
        const Node* node = root.map(key, example);
        if (node == nullptr) return false;
        Reader in(root.loading, *node, std::string(key));
        in.elsewhere(root.loading.top_keys);
        T& read = (config.*member).emplace();
        table().read(in, read);
        if (check != nullptr) check(in, read);
        in.finish();
        return true;
    };
}

template <class T, class U>
auto shown_section(std::string_view key, std::optional<T> Config::* member,
                   const Keys<T, U>& (*table)()) {
    return [=](const SettingWriter& out, const Config& config, const SettingWriter*) {
        if (config.*member) table().show(out.item(key), *(config.*member));
    };
}

void check_http(Reader& root, const Config& config) {
    const Node* node = root.child("http");
    if (!config.http || config.http->port == 0) return;
    const Node* listen = node->find("listen");
    const std::string first = root.loading.firsts.again(
        "listener " + config.http->name(), listen == nullptr ? node->mark : listen->mark);
    if (!first.empty())
        root.problems().add(listen == nullptr ? node->mark : listen->mark,
                            config.http->name() + " is a modbus_tcp listener already" + first);
}

}  // namespace

const Keys<Config>& root_keys() {
    KeyShape lines = shape_of("lines", Kind::list, "Serial lines, at least one.");
    lines.required = true;
    lines.may_be_null = false;
    lines.fewest = 1;
    static const auto kKeys =
        Keys<Config>()
            .value(shape_of("profiles_dir", Kind::text,
                            "Folder of further panel profiles, relative to this file; its *.yaml "
                            "add to the shipped ones or replace them."),
                   read_profiles, [](const Config& config) { return config.profiles_dir; })
            .below(shape_of("templates", Kind::map,
                            "Keys that many stations share, by the template's name: all of a "
                            "station's but id and name."),
                   {}, [](Reader& root, Config&) { return root.has("templates"); }, {})
            .below(
                lines, []() -> const Table& { return line_keys(); }, read_lines,
                [](const SettingWriter& out, const Config& config, const SettingWriter*) {
                    for (const Line& line : config.lines)
                        line_keys().show(out.item("lines", line.name), line);
                })
            .maps("modbus_tcp", &Config::modbus_tcp, listener_keys, "[{listen: 127.0.0.1:502}]",
                  yaml::MapReader::kAnyNumber, load_listener, &tcp_server::Settings::name,
                  "Listeners for Modbus/TCP.")
            .weaker(By::added)
            .maps("serial_masters", &Config::serial_masters, master_keys,
                  "[{name: plc, device: /dev/ttyUSB1, lines: [floor1]}]",
                  yaml::MapReader::kAnyNumber, load_master, &serial_server::Settings::name,
                  "Masters that ask on serial ports of their own, such as a PLC.")
            .weaker(By::added)
            .below(
                shape_of("http", Kind::map, "REST API, dashboard and metrics."),
                []() -> const Table& { return http_keys(); },
                optional_section("http", "{listen: 127.0.0.1:8080}", &Config::http, http_keys),
                shown_section("http", &Config::http, http_keys))
            .weaker(By::added)
            .below(
                shape_of("mqtt", Kind::map, "Values published at an MQTT broker."),
                []() -> const Table& { return mqtt_keys(); }, load_mqtt,
                [](const SettingWriter& out, const Config& config, const SettingWriter*) {
                    if (!config.mqtt) return;
                    mqtt_keys().show(out.item("mqtt"), *config.mqtt);
                    if (!config.mqtt->password.empty())
                        out.below("mqtt").put_secret("password", config.mqtt->password, false);
                })
            .change_needs(kConnectsAnew)
            .map("access", &Config::access, access_keys,
                 "{default: allow, rules: [{name: a, deny: [write]}]}",
                 "Who may do what: the first rule that matches decides.")
            .not_empty("leave it out for no rules")
            .below(
                shape_of("relays", Kind::list, "Values that are copied from panel to panel."),
                []() -> const Table& { return relay_keys(); }, load_relays,
                [](const SettingWriter& out, const Config& config, const SettingWriter*) {
                    for (const points::Relay& relay : config.relays)
                        relay_keys().show(out.item("relays", relay.name()), relay);
                })
            .in_schema([](KeyShape& shape) { shape.most_entries = points::kMaxRelays; })
            .weaker(By::added)
            .map("log", &Config::log, log_keys, "{level: info}", "Log on stderr.")
            .map("realtime", &Config::realtime, realtime_keys, "{priority: 20, lock_memory: true}",
                 "Priority over other programs, so that frames are on time.")
            .change_needs(kNextStart)
            .below(
                shape_of("audit", Kind::map,
                         "Record of what was done, by whom, in a file that can be proven."),
                []() -> const Table& { return audit_keys(); },
                optional_section("audit", "{file: /var/log/panelgate/audit.jsonl}", &Config::audit,
                                 audit_keys),
                shown_section("audit", &Config::audit, audit_keys))
            .weaker(By::removed)
            .not_empty("give file, or leave it out")
            .maps("alarms", &Config::alarms, alarm_keys,
                  "[{name: hot, point: oven/temperature, above: 80}]", alarms::Settings::kMost,
                  load_alarm, &alarms::Settings::name, "What operators are told of at once.")
            .below(
                shape_of("alarm_webhook", Kind::map, "Where changes of alarms are posted to."),
                []() -> const Table& { return webhook_keys(); },
                optional_section("alarm_webhook", "{url: http://127.0.0.1:9093/api/v2/alerts}",
                                 &Config::webhook, webhook_keys, check_webhook),
                shown_section("alarm_webhook", &Config::webhook, webhook_keys))
            .maps("images", &Config::images, image_keys,
                  "[{name: plant, unit: 100, points: [press/temperature]}]",
                  images::Settings::kMost, load_image, &images::Settings::name,
                  "Points of many stations that clients read as one unit.")
            .weaker(By::added)
            .below(
                shape_of("standby", Kind::map,
                         "Another box shares the serial lines: one of the two drives them."),
                []() -> const Table& { return standby_keys(); },
                optional_section("standby", "{rank: 0, peer: \"https://box-b:8443\"}",
                                 &Config::standby, standby_keys, check_standby),
                [](const SettingWriter& out, const Config& config, const SettingWriter*) {
                    if (!config.standby) return;
                    const SettingWriter section = out.item("standby");
                    standby_keys().show(section, *config.standby);
                    section.put_secret("token", config.standby->token, false);
                })
            .weaker(By::removed)
            .not_empty("give rank, or leave it out")
            .map("store", &Config::store, store_keys, "{days: 30}",
                 "Events and history of days, in one file.");
    return kKeys;
}

namespace {

void load_tree(Loading& loading, Node& tree) {
    yaml::resolve_merge_keys(tree, loading.problems);
    drop_extensions(tree);
    const std::vector<Node> unused = apply_templates(loading, tree);
    Reader root(loading, tree, "the configuration");
    if (tree.kind != Node::Kind::map) return;
    root.top = true;
    for (const std::string_view key : root_keys().names())
        loading.top_keys.push_back({key, {}, "the top level", {}, {}, tree.mark.column});
    load_own_roles(loading, tree);
    root_keys().read(root, loading.config);
    keep_profiles(loading.config);
    for (const Node& body : unused) check_template(loading, body);
    check_http(root, loading.config);
    check_servers(root, tree);
    root.elsewhere(kTopElsewhere);
    root.finish();
    if (loading.config.mqtt) loading.config.mqtt->shared = loading.config.standby.has_value();
    if (!loading.problems.empty()) return;
    if (loading.config.lines.empty()) return refuse_no_lines(root);
    warn_of_rules(loading);
    warn_of_listeners(loading, tree);
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

std::string name_fault(std::string_view typed) {
    if (is_name(typed)) return "";
    return "name must be of a-z, 0-9 and '-', not " + yaml::quote(typed) + name_hint(typed);
}

const Form& name_form() {
    static const Form kForm{name_pattern(), true, 0, name_fault};
    return kForm;
}

void check_unique(Reader& in, const std::string& what, const std::string& name) {
    if (!name.empty())
        in.loading.firsts.once(in, "name", what + ' ' + name,
                               "there are two " + what + "s '" + name + '\'');
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

namespace {

std::optional<Config> load_text(std::string_view text, const Files& files, yaml::Problems& problems,
                                const yaml::Environment& environment) {
    const std::vector<std::string_view> sections = root_keys().names();
    yaml::Node tree = yaml::parse(text, problems, sections);
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
    Config config;
    Loading loading{files, found, config};
    load_tree(loading, tree);
    tell(unset, found, problems);
    if (!problems.empty()) return std::nullopt;
    apply_rules(config);
    return config;
}

}  // namespace

std::optional<Config> load(std::string_view text, const Files& files, yaml::Problems& problems,
                           const yaml::Environment& environment) {
    auto config = load_text(text, files, problems, environment);
    if (!config) problems.conceal_secrets(text);
    return config;
}

}  // namespace panelgate::config
