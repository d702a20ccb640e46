#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "loader.hpp"
#include "panelgate/base/suggest.hpp"
#include "panelgate/config/endpoint.hpp"

namespace panelgate::config {
namespace {

using yaml::MapReader;
using yaml::Node;

template <class Settings>
void load_listen(MapReader& in, Settings& settings) {
    const auto text = in.text("listen");
    if (!text) return;
    const auto endpoint = parse_endpoint(*text);
    if (!endpoint) {
        in.problem("listen", "listen must be ADDR:PORT such as 127.0.0.1:502 or [::1]:502, not '" +
                                 *text + '\'');
        return;
    }
    settings.address = endpoint->address;
    settings.port = endpoint->port;
}

const Line* find_line(const Config& config, std::string_view name) {
    const auto found = std::find_if(config.lines.begin(), config.lines.end(),
                                    [&](const Line& line) { return line.name == name; });
    return found == config.lines.end() ? nullptr : &*found;
}

std::string no_line(const Config& config, const std::string& name) {
    std::vector<std::string_view> names;
    for (const Line& line : config.lines) names.push_back(line.name);
    const std::string near = nearest(name, names);
    return "there is no line '" + name + '\'' +
           (near.empty() ? "" : "; did you mean '" + near + "'?");
}

void load_listener_lines(Loading& loading, MapReader& in, tcp_server::Settings& settings) {
    const Node* list = in.sequence("lines");
    if (list == nullptr) {
        for (const Line& line : loading.config.lines) settings.lines.push_back(line.name);
        return;
    }
    for (const Node& item : list->items) {
        if (find_line(loading.config, item.scalar) == nullptr) {
            loading.problems.add(item.mark, no_line(loading.config, item.scalar));
        }
        settings.lines.push_back(item.scalar);
    }
    if (list->items.empty())
        in.problem("lines", "lines must name at least one line; leave it out for all");
}

/// "floor1/31" or "floor1/press" -> line and station; problems at `mark`.
std::optional<tcp_server::UnitTarget> unit_target(Loading& loading, const Node& node) {
    const std::size_t slash = node.scalar.find('/');
    if (slash == std::string::npos) {
        loading.problems.add(node.mark, "a unit points to LINE/STATION such as floor1/31, not '" +
                                            node.scalar + '\'');
        return std::nullopt;
    }
    const std::string name = node.scalar.substr(0, slash);
    const std::string station = node.scalar.substr(slash + 1);
    const Line* line = find_line(loading.config, name);
    if (line == nullptr) {
        loading.problems.add(node.mark, no_line(loading.config, name));
        return std::nullopt;
    }
    for (const Station& known : line->stations) {
        if (known.name == station) return tcp_server::UnitTarget{name, known.id};
    }
    const auto id = yaml::parse_integer(station);
    if (id && *id >= 0 && *id <= modbus::kMaxStation) {
        return tcp_server::UnitTarget{name, static_cast<std::uint8_t>(*id)};
    }
    loading.problems.add(node.mark, "line '" + name + "' has no station '" + station + '\'');
    return std::nullopt;
}

void load_units(Loading& loading, MapReader& in, tcp_server::Settings& settings) {
    const Node* map = in.map("units");
    if (map == nullptr) return;
    for (const yaml::Entry& entry : map->entries) {
        const auto unit = yaml::parse_integer(entry.key);
        if (!unit || *unit < 0 || *unit > 255) {
            loading.problems.add(entry.mark,
                                 "a unit id is from 0 to 255, not '" + entry.key + '\'');
            continue;
        }
        if (const auto target = unit_target(loading, entry.value)) {
            settings.units[static_cast<std::uint8_t>(*unit)] = *target;
        }
    }
}

/// A station id on two lines of one listener must be told apart by `units`.
void check_overlap(Loading& loading, MapReader& in, const tcp_server::Settings& settings) {
    std::map<int, std::string> owner;
    const auto aliased = [&](const std::string& line, std::uint8_t station) {
        return std::any_of(settings.units.begin(), settings.units.end(), [&](const auto& unit) {
            return unit.second.line == line && unit.second.station == station;
        });
    };
    for (const std::string& name : settings.lines) {
        const Line* line = find_line(loading.config, name);
        if (line == nullptr) continue;
        for (const Station& station : line->stations) {
            const auto [first, added] = owner.emplace(station.id, name);
            if (added || (aliased(name, station.id) && aliased(first->second, station.id)))
                continue;
            in.problem("listen",
                       "station " + std::to_string(station.id) + " is on the lines '" +
                           first->second + "' and '" + name +
                           "' of this listener; give both a unit of their own in 'units'");
        }
    }
}

void load_allow(Loading& loading, MapReader& in, tcp_server::Settings& settings) {
    const Node* list = in.sequence("allow");
    if (list == nullptr) return;
    for (const Node& item : list->items) {
        const auto cidr = parse_cidr(item.scalar);
        if (cidr) {
            settings.allow.push_back({cidr->address, cidr->prefix});
        } else {
            loading.problems.add(item.mark, "allow lists networks such as 192.168.1.0/24, not '" +
                                                item.scalar + '\'');
        }
    }
    if (list->items.empty())
        in.problem("allow", "allow must name at least one network; leave it out for all");
}

void load_access(MapReader& in, tcp_server::Settings& settings) {
    const Node* access = in.child("access");
    if (access == nullptr) return;
    if (access->kind != Node::Kind::scalar) {
        in.problem("access", "access rules are not in this version; use read_write or read_only");
        return;
    }
    constexpr std::array<std::string_view, 2> kAccess{"read_write", "read_only"};
    settings.read_only = in.choice_index("access", kAccess) == std::size_t{1};
}

tcp_server::Settings load_listener(Loading& loading, const Node& node) {
    MapReader in(node, loading.problems, "a modbus_tcp listener");
    tcp_server::Settings settings;
    load_listen(in, settings);
    load_listener_lines(loading, in, settings);
    load_units(loading, in, settings);
    check_overlap(loading, in, settings);
    using Mode = tcp_server::BroadcastMode;
    constexpr std::array<std::pair<std::string_view, Mode>, 3> kModes{
        {{"reply", Mode::reply}, {"silent", Mode::silent}, {"deny", Mode::deny}}};
    settings.broadcast = in.choice<Mode>("broadcast", kModes).value_or(settings.broadcast);
    if (in.has("diagnostics_unit")) {
        settings.diagnostics_unit.reset();
        if (in.child("diagnostics_unit") != nullptr) {
            const auto unit = in.integer("diagnostics_unit", 1, 255);
            if (unit) settings.diagnostics_unit = static_cast<std::uint8_t>(*unit);
        }
    }
    load_access(in, settings);
    load_allow(loading, in, settings);
    settings.max_connections =
        static_cast<std::size_t>(in.integer("max_connections", 1, 65535).value_or(1024));
    if (in.has("tls"))
        in.problem("tls",
                   "tls is not in this version; remove it and listen on a trusted network only");
    in.finish();
    return settings;
}

web::Token load_token(Loading& loading, const Node& node) {
    MapReader in(node, loading.problems, "a token");
    web::Token token;
    token.name = in.required_text("name").value_or("");
    constexpr std::array<std::pair<std::string_view, web::Role>, 2> kRoles{
        {{"viewer", web::Role::viewer}, {"operator", web::Role::operator_}}};
    token.role = in.choice<web::Role>("role", kRoles).value_or(web::Role::viewer);
    const auto file = in.required_text("file");
    if (file) {
        const auto secret = loading.files.read(*file);
        const std::size_t end = secret ? secret->find_last_not_of(" \t\r\n") : std::string::npos;
        if (end == std::string::npos) {
            in.problem("file",
                       "cannot read a token from " + *file + (secret ? ": it is empty" : ""));
        } else {
            token.secret = secret->substr(0, end + 1);
        }
    }
    in.finish();
    return token;
}

}  // namespace

void load_modbus_tcp(Loading& loading, MapReader& root) {
    const Node* list = root.sequence("modbus_tcp");
    if (list == nullptr) return;
    for (const Node& node : list->items) {
        tcp_server::Settings settings = load_listener(loading, node);
        for (const tcp_server::Settings& other : loading.config.modbus_tcp) {
            if (settings.port == 0 || other.name() != settings.name()) continue;
            loading.problems.add(node.mark, "two listeners on " + settings.name());
        }
        loading.config.modbus_tcp.push_back(std::move(settings));
    }
}

void load_http(Loading& loading, MapReader& root) {
    const Node* node = root.map("http");
    if (node == nullptr) return;
    MapReader in(*node, loading.problems, "http");
    web::Settings settings;
    load_listen(in, settings);
    constexpr std::array<std::pair<std::string_view, web::Role>, 3> kRoles{
        {{"none", web::Role::none},
         {"viewer", web::Role::viewer},
         {"operator", web::Role::operator_}}};
    settings.anonymous = in.choice<web::Role>("anonymous", kRoles).value_or(settings.anonymous);
    if (const Node* list = in.sequence("tokens")) {
        for (const Node& item : list->items) settings.tokens.push_back(load_token(loading, item));
    }
    if (in.has("tls"))
        in.problem("tls",
                   "tls is not in this version; remove it and listen on a trusted network only");
    in.finish();
    loading.config.http = std::move(settings);
}

}  // namespace panelgate::config
