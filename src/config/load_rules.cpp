// The rules of `access`: who may do what.
#include <algorithm>
#include <array>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hints.hpp"
#include "load_access.hpp"
#include "load_roles.hpp"
#include "loader.hpp"
#include "panelgate/access/line_rules.hpp"
#include "panelgate/access/settings.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/yaml/document.hpp"
#include "rule_items.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using access::Act;
using access::Rule;
using yaml::MapReader;
using yaml::Node;

constexpr std::string_view kRuleExample =
    "{name: no-writes, deny: [write], from: [192.168.10.0/24]}";
constexpr std::string_view kAny = "any";
constexpr Words<Act, 4> kActs{
    {{"read", Act::read}, {"write", Act::write}, {"broadcast", Act::broadcast}, {"raw", Act::raw}}};
constexpr Words<Face, 4> kFaces{{{"modbus_tcp", Face::modbus_tcp},
                                 {"http", Face::http},
                                 {"mqtt", Face::mqtt},
                                 {"serial_master", Face::serial_master}}};

/// Words that other programs have for reading and writing.
constexpr std::array<std::string_view, 5> kBoth{"rw", "read_write", "readwrite", "all", "true"};

template <class T, std::size_t N>
std::vector<T> words(Loading& loading, MapReader& in, std::string_view key,
                     std::string_view example, const Words<T, N>& known) {
    std::vector<std::string_view> names;
    for (const auto& [name, value] : known) names.push_back(name);
    std::vector<T> all;
    for (const Node* item : in.items(key, example, kAny)) {
        const auto found = std::ranges::find(known, item->scalar, &Words<T, N>::value_type::first);
        if (found != known.end()) {
            all.push_back(found->second);
        } else {
            const std::string wrong =
                yaml::no_such(key == "faces" ? "face" : "act", item->scalar, names);
            const std::string_view typed = item->scalar;
            const bool both = std::ranges::find(kBoth, typed) != kBoth.end() && key != "faces";
            loading.problems.add(item->mark, both ? "there is no act '" + item->scalar +
                                                        "'; write [read, write], or write alone"
                                                  : wrong);
        }
    }
    in.looks_like_one_of(key, names);
    return all;
}

/// `allow` or `deny`: one of them.
void load_acts(Loading& loading, MapReader& in, Rule& rule) {
    const bool allows = in.has("allow");
    const bool denies = in.has("deny");
    for (const std::string_view key : {"allow", "deny"}) {
        for (const Act act : words(loading, in, key, "[read, write]", kActs)) rule.acts.add(act);
    }
    rule.allow = allows;
    if (allows == denies)
        in.problem(allows ? "deny" : "name",
                   allows ? "a rule has allow or deny, not both; make two rules of it"
                          : "a rule needs allow or deny, such as deny: [write]");
}

/// A role of a certificate may be any word.
void load_roles(Loading& loading, MapReader& in, Rule& rule) {
    for (const Node* item : in.items("roles", "[viewer, operator]", kAny)) {
        rule.roles.push_back(item->scalar);
        if (!is_role(loading.config, item->scalar))
            loading.warn(item->mark,
                         "no token has the role " + yaml::quote(item->scalar) +
                             ", only a client's certificate can carry it" +
                             did_you_mean(item->scalar, role_words(loading.config), "roles"));
    }
}

/// Names that stand elsewhere in the file.
std::vector<std::string> load_names(Loading& loading, MapReader& in, std::string_view key,
                                    std::string_view example, std::string_view what,
                                    const std::vector<std::string>& names) {
    const std::vector<std::string_view> known(names.begin(), names.end());
    std::vector<std::string> all;
    for (const Node* item : in.items(key, example, kAny)) {
        all.push_back(item->scalar);
        if (std::ranges::find(names, item->scalar) == names.end())
            loading.problems.add(item->mark, yaml::no_such(what, item->scalar, known));
    }
    return all;
}

std::vector<std::string> token_names(const Config& config) {
    std::vector<std::string> all;
    if (!config.http) return all;
    for (const web::Token& token : config.http->tokens) all.push_back(token.name);
    return all;
}

std::vector<std::string> listener_names(const Config& config) {
    std::vector<std::string> all;
    for (const auto& listener : config.modbus_tcp) all.push_back(listener.name());
    for (const auto& master : config.serial_masters) all.push_back(master.name);
    if (config.http) all.push_back(config.http->name());
    if (config.mqtt) all.push_back(config.mqtt->broker());
    return all;
}

/// A station's name, or LINE/ID.
std::optional<access::Place> place_of(const Config& config, const std::string& text) {
    const std::size_t slash = text.find('/');
    for (const Line& line : config.lines) {
        const bool of_line = slash != text.npos && text.substr(0, slash) == line.name;
        const auto id = of_line ? yaml::parse_integer(text.substr(slash + 1)) : std::nullopt;
        for (const Station& station : line.stations) {
            if (station.name == text || id == station.id)
                return access::Place{line.name, station.id};
        }
        if (id && *id >= 1 && *id <= modbus::kMaxStation)
            return access::Place{line.name, static_cast<std::uint8_t>(*id)};
    }
    return std::nullopt;
}

void load_stations(Loading& loading, MapReader& in, Rule& rule) {
    for (const Node* item : in.items("stations", "[press]", kAny)) {
        if (const auto place = place_of(loading.config, item->scalar)) {
            rule.stations.push_back(*place);
        } else if (!loading.names_missing) {
            const std::vector<std::string_view> names(loading.station_names.begin(),
                                                      loading.station_names.end());
            loading.problems.add(item->mark, yaml::no_such("station", item->scalar, names));
        }
    }
}

void load_functions(Loading& loading, MapReader& in, Rule& rule) {
    constexpr std::int64_t kLast = 127;
    const std::vector<const Node*> items = in.items("functions", "[16, 23]", kAny);
    yaml::KeyShape& schema = in.schema("functions");
    schema.holds_integers = true;
    schema.min = 1;
    schema.max = kLast;
    for (const Node* item : items) {
        const auto code = yaml::parse_integer(item->scalar);
        if (code && *code >= 1 && *code <= kLast) {
            rule.functions.push_back(static_cast<std::uint8_t>(*code));
        } else {
            loading.problems.add(item->mark,
                                 "functions lists codes from 1 to 127, such as 16, not " +
                                     yaml::quote(item->scalar));
        }
    }
}

void load_name_of(Loading& loading, MapReader& in, Rule& rule) {
    rule.name = load_unique_name(loading, in, "rule");
    if (rule.name == "default")
        in.problem("name", "a rule cannot be called default: that is what no rule decides");
    if (is_role(loading.config, rule.name))
        in.problem("name", "a rule cannot be called as a role: refusals name either");
}

void load_rule(Loading& loading, const Node& node) {
    MapReader in(node, loading.problems, "a rule", kRuleExample);
    Rule rule;
    rule.line = node.mark.line;
    rule.column = node.mark.column;
    load_name_of(loading, in, rule);
    load_acts(loading, in, rule);
    load_networks(loading, in, "from", rule.from);
    load_roles(loading, in, rule);
    rule.tokens = load_names(loading, in, "tokens", "[ops]", "token", token_names(loading.config));
    rule.faces = words(loading, in, "faces", "[modbus_tcp]", kFaces);
    rule.listeners = load_names(loading, in, "listeners", "[\"0.0.0.0:502\"]", "listener",
                                listener_names(loading.config));
    load_stations(loading, in, rule);
    load_functions(loading, in, rule);
    load_range(loading, in, rule);
    rule_keys().read(in, rule);
    in.finish();
    loading.config.access.rules.push_back(std::move(rule));
}

}  // namespace

namespace {

/// True if a condition lets everything through that the other does. An empty one lets all through.
template <class List>
bool is_as_wide(const List& wide, const List& narrow) {
    if (wide.empty()) return true;
    return !narrow.empty() && std::ranges::all_of(narrow, [&](const auto& one) {
        return std::ranges::find(wide, one) != wide.end();
    });
}

bool is_as_wide_network(const std::vector<Network>& wide, const std::vector<Network>& narrow) {
    if (wide.empty()) return true;
    return !narrow.empty() && std::ranges::all_of(narrow, [&](const Network& one) {
        return std::ranges::any_of(wide,
                                   [&](const Network& network) { return covers(network, one); });
    });
}

/// True if all of the first are within the second at each station.
bool has_items_of(const Rule& wide, const Rule& narrow) {
    if (!wide.has_range()) return true;
    if (!narrow.has_range()) return false;
    // Of stations that are not listed a rule speaks only if it names none, or one of them.
    const bool only_listed = !narrow.stations.empty() &&
                             std::ranges::all_of(narrow.stations, [&](const access::Place& place) {
                                 return narrow.items.contains(place);
                             });
    if (!only_listed && wide.unlisted_items != narrow.unlisted_items) return false;
    return std::ranges::all_of(narrow.items, [&](const auto& at) {
        const auto other = wide.items.find(at.first);
        if (other == wide.items.end()) return false;
        return std::ranges::all_of(at.second, [&](const modbus::Span& span) {
            return std::ranges::any_of(
                other->second, [&](const modbus::Span& holder) { return holder.contains(span); });
        });
    });
}

/// Why nobody can fulfil its conditions; "" if somebody can.
std::string_view contradiction(const Rule& rule) {
    const auto only = [&](std::initializer_list<Face> faces) {
        return !rule.faces.empty() && std::ranges::all_of(rule.faces, [&](Face face) {
            return std::ranges::find(faces, face) != faces.end();
        });
    };
    if (!rule.tokens.empty() && only({Face::modbus_tcp, Face::mqtt, Face::serial_master}))
        return "only clients of http have tokens";
    if (!rule.from.empty() && only({Face::mqtt, Face::serial_master}))
        return "these faces have no addresses";
    const bool only_raw = rule.acts == access::Acts{Act::raw};
    if (only_raw && only({Face::modbus_tcp, Face::mqtt, Face::serial_master}))
        return "raw requests come by http only";
    return "";
}

/// True if whatever `rule` matches has been decided by `earlier`.
bool decides_all_of(const Rule& earlier, const Rule& rule) {
    const bool acts = std::ranges::all_of(kActs, [&](const auto& act) {
        return earlier.acts.has(act.second) || !rule.acts.has(act.second);
    });
    // A range says nothing of functions without items, so one that names functions is left alone.
    const bool functions = earlier.functions.empty()
                               ? !earlier.has_range() || rule.functions.empty()
                               : is_as_wide(earlier.functions, rule.functions);
    return acts && functions && is_as_wide_network(earlier.from, rule.from) &&
           is_as_wide(earlier.roles, rule.roles) && is_as_wide(earlier.tokens, rule.tokens) &&
           is_as_wide(earlier.faces, rule.faces) && is_as_wide(earlier.listeners, rule.listeners) &&
           is_as_wide(earlier.stations, rule.stations) && has_items_of(earlier, rule);
}

/// Warns of rules that never decide anything.
void warn_of_rules(Loading& loading) {
    const std::vector<Rule>& rules = loading.config.access.rules;
    for (std::size_t i = 0; i < rules.size(); ++i) {
        const yaml::Mark mark{rules[i].line, rules[i].column};
        const std::string never = "rule '" + rules[i].name + "' never decides anything: ";
        if (const auto why = contradiction(rules[i]); !why.empty()) {
            loading.warn(mark, never + std::string(why));
            continue;
        }
        for (std::size_t j = 0; j < i; ++j) {
            if (!decides_all_of(rules[j], rules[i])) continue;
            loading.warn(mark, never + "rule '" + rules[j].name + "' in line " +
                                   std::to_string(rules[j].line) + " matches all of it before");
            break;
        }
    }
}

}  // namespace

void load_rules(Loading& loading, MapReader& root) {
    load_section(
        loading, root, "access", "{default: allow, rules: [{name: a, deny: [write]}]}",
        [&](MapReader& in) {
            rules_keys().read(in, loading.config.access);
            // load_own_roles() reads them
            in.entries("roles", "[{name: setter, rights: [read, write]}]",
                       access::Settings::kMaxRoles, "roles");
            for (const Node& item : in.entries("rules", "[" + std::string(kRuleExample) + "]",
                                               access::Settings::kMaxRules, "rules"))
                load_rule(loading, item);
            in.refuse_empty("rules", "give at least one rule, or leave it out");
            in.refuse_empty("roles", "give at least one role, or leave it out");
        });
    root.refuse_empty("access", "leave it out for no rules");
    if (loading.problems.empty()) warn_of_rules(loading);
}

void apply_rules(Config& config) {
    const auto shared = std::make_shared<const access::Settings>(config.access);
    std::vector<std::string> words;
    for (const Rule& rule : config.access.rules)
        words.insert(words.end(), rule.roles.begin(), rule.roles.end());
    const auto give = [&](std::optional<tls::Settings>& tls) {
        if (!tls) return;
        tls->own_roles = config.access.roles;
        tls->rule_roles = words;
    };
    for (tcp_server::Settings& listener : config.modbus_tcp) give(listener.tls);
    if (config.http) give(config.http->tls);
    for (Line& line : config.lines) {
        std::vector<std::uint8_t> listed;
        for (const Station& station : line.stations) listed.push_back(station.id);
        line.access.rules =
            std::make_shared<const access::LineRules>(shared, line.name, std::move(listed));
    }
}

}  // namespace panelgate::config
