// `access`: rows of roles and rules, the items that a rule is about, and rules that decide nothing.

#include <algorithm>
#include <array>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/access/line_rules.hpp"
#include "panelgate/modbus/function.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using access::Act;
using access::Place;
using access::Rule;
using modbus::Span;
using yaml::Node;

constexpr std::string_view kAny = "any";
constexpr std::array<std::string_view, 4> kDefaultRoles{"viewer", "operator", "engineer", "admin"};
constexpr Words<Act, 4> kActs{
    {{"read", Act::read}, {"write", Act::write}, {"broadcast", Act::broadcast}, {"raw", Act::raw}}};
constexpr Words<Face, 4> kFaces{{{"modbus_tcp", Face::modbus_tcp},
                                 {"http", Face::http},
                                 {"mqtt", Face::mqtt},
                                 {"serial_master", Face::serial_master}}};

bool is_role(const Config& config, std::string_view word) {
    const std::vector<std::string_view> words = role_words(config);
    return std::ranges::find(words, word) != words.end();
}

// Roles

/// The rights by their words.
std::vector<std::string_view> right_words() {
    std::vector<std::string_view> words;
    for (const Right right : kAllRights) words.push_back(label(right));
    return words;
}

const Keys<OwnRole>& own_role_keys() {
    KeyShape rights =
        items_shape("rights",
                    {"[read, write]", kAny,
                     [] {
                         std::string pattern;
                         for (const std::string_view name : right_words())
                             pattern += (pattern.empty() ? "^(" : "|") + std::string(name);
                         return pattern + ")$";
                     }()},
                    "What it may do: read, write, broadcast, raw, discover, "
                    "simulator, reload, acknowledge, configure. A broadcast is also a write, and "
                    "raw also a read or a write.");
    rights.required = true;
    static const auto kKeys =
        Keys<OwnRole>()
            .text("name", &OwnRole::name, name_form(),
                  "Name of the role, for tokens, anonymous, certificates and rules.")
            .required()
            .example("setter")
            .value(
                rights,
                [](Reader& in, OwnRole& role) {
                    const auto items = in.scalars("rights", "[read, write]");
                    for (const Node* item : items) {
                        const auto known = std::ranges::find_if(
                            kAllRights, [&](Right right) { return label(right) == item->scalar; });
                        if (known != kAllRights.end())
                            role.rights.add(*known);
                        else
                            in.problems().add(item->mark,
                                              yaml::no_such("right", item->scalar, right_words()));
                    }
                    if (items.empty())
                        in.problem(in.has("rights") ? "rights" : "name",
                                   "a role needs rights, such as rights: [read, write]");
                    return !items.empty();
                },
                [](const OwnRole& role) {
                    std::vector<Right> all;
                    for (const Right right : kAllRights)
                        if (role.rights.has(right)) all.push_back(right);
                    return as_written(all);
                })
            .weaker(By::more)
            .example("[read, write]");
    return kKeys;
}

std::optional<OwnRole> load_own_role(Loading& loading, const Node& node) {
    Reader in(loading, node, "a role", "{name: setter, rights: [read, write]}");
    OwnRole role;
    own_role_keys().read(in, role);
    check_unique(in, "role", role.name);
    const bool is_taken = role.name == "none" || role.name == "default" ||
                          std::ranges::find(kDefaultRoles, role.name) != kDefaultRoles.end();
    if (is_taken)
        in.problem("name", "the role '" + role.name + "' is there already; give it another name");
    in.finish();
    if (is_taken || role.name.empty()) return std::nullopt;
    return role;
}

// Rules

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

/// Names that stand elsewhere in the file.
auto named(std::string_view what, std::vector<std::string> (*names_of)(const Config&)) {
    return [=](Reader& in, const Node& item) -> std::optional<std::string> {
        const std::vector<std::string> names = names_of(in.loading.config);
        const std::vector<std::string_view> known(names.begin(), names.end());
        if (std::ranges::find(names, item.scalar) == names.end())
            in.problems().add(item.mark, yaml::no_such(what, item.scalar, known));
        return item.scalar;
    };
}

/// A role of a certificate may be any word.
std::optional<std::string> read_rule_role(Reader& in, const Node& item) {
    if (!is_role(in.loading.config, item.scalar))
        in.loading.warn(item.mark,
                        "no token has the role " + yaml::quote(item.scalar) +
                            ", only a client's certificate can carry it" +
                            did_you_mean(item.scalar, role_words(in.loading.config), "roles"));
    return item.scalar;
}

std::optional<Place> read_place(Reader& in, const Node& item) {
    const Loading& loading = in.loading;
    const auto place = place_of(loading.config, item.scalar);
    const std::vector<std::string_view> names(loading.station_names.begin(),
                                              loading.station_names.end());
    if (!place && !loading.names_missing)
        in.problems().add(item.mark, yaml::no_such("station", item.scalar, names));
    return place;
}

constexpr std::int64_t kLastFunction = 127;

std::optional<std::uint8_t> read_function(Reader& in, const Node& item) {
    const auto code = yaml::parse_integer(item.scalar);
    if (code && *code >= 1 && *code <= kLastFunction) return static_cast<std::uint8_t>(*code);
    in.problems().add(item.mark, "functions lists codes from 1 to 127, such as 16, not " +
                                     yaml::quote(item.scalar));
    return std::nullopt;
}

std::string acts_text(const Rule& rule, bool allowed) {
    std::vector<Act> all;
    for (const auto& [name, act] : kActs)
        if (rule.allow == allowed && rule.acts.has(act)) all.push_back(act);
    return as_written(all);
}

/// `allow` or `deny`.
KeyShape acts_shape(std::string_view key, std::string_view text) {
    return items_shape(key, {"[read, write]", kAny, "^(read|write|broadcast|raw)$"}, text);
}
bool read_acts(Reader& in, std::string_view key, bool allows, Rule& rule) {
    for (const Node* item : in.items(key, "[read, write]", kAny)) {
        const auto found =
            std::ranges::find(kActs, item->scalar, &decltype(kActs)::value_type::first);
        if (found != kActs.end())
            rule.acts.add(found->second);
        else
            in.problems().add(item->mark, yaml::no_such("act", item->scalar, names_of(kActs)));
    }
    if (in.has(key)) rule.allow = allows;
    return in.has(key);
}

const Keys<Rule>& rule_keys() {
    KeyShape range = shape_of("range", Kind::map,
                              "Items: FIRST-LAST in the panel's notation, such as UW100-UW199, "
                              "TABLE/FIRST-LAST, or a map. Functions without items are among them "
                              "only where `functions` names them.");
    range.weaker.by = By::any;
    range.may_be_text = true;
    range.may_be_null = false;
    static const auto kKeys =
        Keys<Rule>()
            .text("name", &Rule::name, name_form(),
                  "Name of the rule, for refusals, metrics and the audit; unique.")
            .required()
            .example("no-other-writes")
            .value(
                acts_shape("allow",
                           "What the rule allows: read, write, broadcast (also a write), raw "
                           "(also a read or a write)."),
                [](Reader& in, Rule& rule) { return read_acts(in, "allow", true, rule); },
                [](const Rule& rule) { return acts_text(rule, true); })
            .weaker(By::any)
            .example("[read, write]")
            .value(
                acts_shape("deny", "What the rule denies; a rule has allow or deny."),
                [](Reader& in, Rule& rule) { return read_acts(in, "deny", false, rule); },
                [](const Rule& rule) { return acts_text(rule, false); })
            .weaker(By::any)
            .example("[write, broadcast, raw]")
            .networks("from", &Rule::from, kAny,
                      "Networks of the clients that it is about. Without it any.")
            .weaker(By::any)
            .example("[192.168.10.0/24]")
            .list("roles", &Rule::roles, {"[viewer, operator]", kAny}, read_rule_role,
                  "Roles that it is about: viewer, operator, engineer, admin, one of access.roles, "
                  "or a role of a client's certificate. Modbus clients without one are operators.")
            .weaker(By::any)
            .example("[operator]")
            .list("tokens", &Rule::tokens, {"[ops]", kAny}, named("token", token_names),
                  "Tokens that it is about, by name.")
            .weaker(By::any)
            .example("[ops]")
            .words("faces", &Rule::faces, {"[modbus_tcp]", kAny}, kFaces, "face",
                   "Ways in: modbus_tcp (UDP, too), http, mqtt, serial_master.")
            .weaker(By::any)
            .example("[http]")
            .list("listeners", &Rule::listeners, {"[\"0.0.0.0:502\"]", kAny},
                  named("listener", listener_names),
                  "Listeners by their address, or serial masters by name.")
            .weaker(By::any)
            .example("[127.0.0.1:8080]")
            .list("stations", &Rule::stations, {"[press]", kAny}, read_place,
                  "Stations by name, or LINE/ID. Without it all.")
            .weaker(By::any)
            .example("[press]")
            .list("functions", &Rule::functions,
                  {"[16, 23]", kAny, {}, false, {1, kLastFunction}, true}, read_function,
                  "Function codes. Without it all.")
            .weaker(By::any)
            .example("[16]")
            .below(range, []() -> const Table& { return table_range_table(); }, read_range, {})
            .shown_as([](const Rule& rule) { return rule.range; });
    return kKeys;
}

std::optional<Rule> load_rule(Reader& owner, const Node& node) {
    Reader in(owner.loading, node, "a rule",
              "{name: no-writes, deny: [write], from: [192.168.10.0/24]}");
    Rule rule;
    rule.line = node.mark.line;
    rule.column = node.mark.column;
    rule_keys().read(in, rule);
    check_unique(in, "rule", rule.name);
    if (rule.name == "default")
        in.problem("name", "a rule cannot be called default: that is what no rule decides");
    if (is_role(in.loading.config, rule.name))
        in.problem("name", "a rule cannot be called as a role: refusals name either");
    if (in.has("allow") && in.has("deny"))
        in.problem("deny", "a rule has allow or deny, not both; make two rules of it");
    if (!in.has("allow") && !in.has("deny"))
        in.problem("name", "a rule needs allow or deny, such as deny: [write]");
    in.finish();
    return rule;
}

}  // namespace

std::vector<std::string_view> role_words(const Config& config) {
    std::vector<std::string_view> words(kDefaultRoles.begin(), kDefaultRoles.end());
    for (const OwnRole& role : config.access.roles) words.push_back(role.name);
    return words;
}

/// Before other maps, which name roles.
void load_own_roles(Loading& loading, const Node& tree) {
    const Node* access = tree.find("access");
    const Node* list = access == nullptr ? nullptr : access->find("roles");
    // The row of the list says what is wrong with it.
    if (list == nullptr || list->items.size() > access::Settings::kMaxRoles) return;
    for (const Node& item : list->items)
        if (auto role = load_own_role(loading, item))
            loading.config.access.roles.push_back(std::move(*role));
}

const Keys<access::Settings>& access_keys() {
    using access::Settings;
    static constexpr Words<bool, 2> kDefaults{{{"allow", true}, {"deny", false}}};
    static const auto kKeys =
        Keys<Settings>()
            .word("default", &Settings::allow_by_default, kDefaults,
                  "What happens if no rule matches: allow or deny.")
            .weaker(By::coming, "allow")
            .example("allow")
            .maps(
                "roles", &Settings::roles, own_role_keys, "[{name: setter, rights: [read, write]}]",
                Settings::kMaxRoles,
                [](Reader&, const Node&) { return std::optional<OwnRole>(); },  // load_own_roles()
                &OwnRole::name, "Roles besides viewer, operator, engineer and admin.")
            .weaker(By::added)
            .not_empty("give at least one role, or leave it out")
            .maps("rules", &Settings::rules, rule_keys,
                  "[{name: no-writes, deny: [write], from: [192.168.10.0/24]}]",
                  Settings::kMaxRules, load_rule, &Rule::name,
                  "Rules, in the order in which they are asked.")
            .not_empty("give at least one rule, or leave it out");
    return kKeys;
}

namespace {

/// True if the wide condition lets everything through that the narrow condition lets through. An
/// empty condition lets everything through.
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
    // A rule decides about unlisted stations only if the rule names no station, or an unlisted
    // station.
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
    // A range does not restrict functions without items, so rules that name functions are not
    // warned of.
    const bool functions = earlier.functions.empty()
                               ? !earlier.has_range() || rule.functions.empty()
                               : is_as_wide(earlier.functions, rule.functions);
    return acts && functions && is_as_wide_network(earlier.from, rule.from) &&
           is_as_wide(earlier.roles, rule.roles) && is_as_wide(earlier.tokens, rule.tokens) &&
           is_as_wide(earlier.faces, rule.faces) && is_as_wide(earlier.listeners, rule.listeners) &&
           is_as_wide(earlier.stations, rule.stations) && has_items_of(earlier, rule);
}

}  // namespace

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
