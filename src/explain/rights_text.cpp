#include "panelgate/explain/rights_text.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>

#include "panelgate/access/line_rules.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/explain/doors.hpp"

namespace panelgate::explain {

namespace {

using access::Act;
using access::Rule;

/// A way in, and who comes by it.
struct Door {
    std::string name;
    WhoRef who;
    bool read_only = false;
    bool is_open = false;                 ///< whoever reaches it comes in
    std::optional<Destinations> leads{};  ///< nothing: to all stations
};

Door door(std::string name, Who who) {
    const bool writes = who.standing.may(Right::write);
    const bool is_open = who.token.empty();
    return {std::move(name), make_who(std::move(who)), !writes, is_open};
}

void add_http(const web::Settings& http, std::vector<Door>& doors) {
    Who who{.face = Face::http, .listener = http.name(), .standing = http.anonymous};
    if (http.anonymous.role != Role::none) {
        doors.push_back(door("http " + http.name(), who));
        doors.back().is_open = !tls::wants_certificate(http.tls);
    }
    if (tls::goes_by_certificates(http.tls)) {
        who.standing = Role::operator_;
        doors.push_back(door("http " + http.name() + " with a certificate of an operator", who));
        doors.back().is_open = false;
    }
    for (const web::Token& token : http.tokens) {
        who.token = token.name;
        who.standing = token.standing;
        doors.push_back(door("http token " + token.name, who));
    }
}

/// The networks that rules name: each may be treated in its own way.
std::vector<Network> networks_of(const access::Settings& settings) {
    std::vector<Network> all;
    for (const Rule& rule : settings.rules) {
        for (const Network& network : rule.from) {
            if (std::ranges::find(all, network) == all.end()) all.push_back(network);
        }
    }
    return all;
}

std::vector<Door> doors_of(const config::Config& config) {
    std::vector<Door> doors;
    const std::vector<Network> networks = networks_of(config.access);
    for (const tcp_server::Settings& listener : config.modbus_tcp) {
        Who who{.face = Face::modbus_tcp, .listener = listener.name(), .standing = Role::operator_};
        const bool by_role = tls::goes_by_certificates(listener.tls);
        const std::string name =
            "modbus_tcp " + listener.name() + (by_role ? " with a certificate of an operator" : "");
        doors.push_back(door(name, who));
        doors.back().read_only = listener.read_only;
        doors.back().is_open = !by_role && !tls::wants_certificate(listener.tls);
        doors.back().leads = destinations_of(listener, config, Unlisted::as_the_line);
        const std::size_t all = doors.size() - 1;
        for (const Network& network : networks) {
            who.address = network.address;
            Door some = doors[all];
            some.name += " from " + network.address + '/' + std::to_string(network.prefix);
            some.who = make_who(who);
            some.is_open = false;
            doors.push_back(std::move(some));
        }
    }
    for (const serial_server::Settings& master : config.serial_masters) {
        doors.push_back(door(
            "serial master " + master.name,
            {.face = Face::serial_master, .listener = master.name, .standing = Role::operator_}));
        doors.back().read_only = master.access.read_only;
        doors.back().leads = destinations_of(master.access, config, Unlisted::refused);
    }
    if (config.http) add_http(*config.http, doors);
    if (config.mqtt) {
        doors.push_back(door(
            "mqtt " + config.mqtt->broker(),
            {.face = Face::mqtt, .listener = config.mqtt->broker(), .standing = Role::operator_}));
        doors.back().read_only = !config.mqtt->write;
    }
    return doors;
}

/// Where a door's clients may write everything, something and nothing.
struct Reach {
    std::vector<std::string> all;
    std::vector<std::string> some;
    std::vector<std::string> none;
};

Reach reach_of(const config::Config& config, const Door& door) {
    Reach reach;
    for (const config::Line& line : config.lines) {
        for (const config::Station& station : line.stations) {
            const access::LineRules& rules = *line.access.rules;
            const bool served = !door.leads || leads_to(*door.leads, line.name, station.id);
            const bool never = !served || door.read_only || station.read_only || station.listens;
            if (never || !rules.may_some(door.who, station.id, Act::write)) {
                reach.none.push_back(station.name);
            } else if (rules.may_all(door.who, station.id, Act::write)) {
                reach.all.push_back(station.name);
            } else {
                reach.some.push_back(station.name);
            }
        }
    }
    return reach;
}

std::string words(const std::vector<std::string>& names) {
    constexpr std::size_t kMost = 12;
    std::string text;
    for (std::size_t i = 0; i < names.size() && i < kMost; ++i)
        text += (i == 0 ? "" : ", ") + names[i];
    if (names.size() > kMost) text += " and " + std::to_string(names.size() - kMost) + " more";
    return text;
}

std::string row(const Reach& reach) {
    if (reach.all.empty() && reach.some.empty()) return "nowhere";
    if (reach.some.empty() && reach.none.empty()) return "everywhere";
    std::string text;
    if (!reach.all.empty()) text = "all of " + words(reach.all);
    if (!reach.some.empty()) text += (text.empty() ? "" : "; ") + ("some of " + words(reach.some));
    if (!reach.none.empty()) text += "; nothing of " + words(reach.none);
    return text;
}

}  // namespace

std::string rights_matrix(const config::Config& config) {
    if (config.access.is_open()) return "";
    std::string text = "who may write, by " + std::to_string(config.access.rules.size()) +
                       " rule(s) of access and else " +
                       (config.access.allow_by_default ? "allowed" : "denied") + ":\n";
    for (const Door& door : doors_of(config))
        text += "  " + door.name + ": " + row(reach_of(config, door)) + '\n';
    return text;
}

std::vector<std::string> open_doors(const config::Config& config) {
    std::vector<std::string> warnings;
    const bool denies = std::ranges::any_of(config.access.rules, [](const Rule& rule) {
        return !rule.allow && rule.acts.has(Act::write);
    });
    if (!denies || !config.access.allow_by_default) return warnings;
    for (const Door& door : doors_of(config)) {
        if (!door.is_open) continue;
        const Reach reach = reach_of(config, door);
        if (reach.all.empty()) continue;
        warnings.push_back("rules deny writes, but any client of " + door.name +
                           " may write everything to " + words(reach.all) +
                           ": no rule is about it, and the default is allow; end with a rule "
                           "without conditions, or set default: deny");
    }
    return warnings;
}

}  // namespace panelgate::explain
