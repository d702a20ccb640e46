#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hints.hpp"
#include "load_access.hpp"
#include "load_roles.hpp"
#include "load_tls.hpp"
#include "loader.hpp"
#include "panelgate/config/describe.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/yaml/document.hpp"
#include "tables.hpp"

namespace panelgate::config {

/// Reads a listener's protocol keys: `framing`, `udp`, `ascii_lower_case`, `broadcast` and
/// `retransmissions`.
void load_framing(yaml::MapReader& in, tcp_server::Settings& settings);

namespace {

using modbus::Framing;
using tcp_server::BroadcastMode;
using tcp_server::Retransmissions;
using yaml::MapReader;

std::string framing_is(Framing framing) {
    return "framing: " + std::string(modbus::label(framing));
}

/// Refuses what RTU and ASCII do not support.
void refuse_in_serial_modes(MapReader& in, const tcp_server::Settings& settings) {
    const std::string here = " with " + framing_is(settings.framing);
    if (in.has("broadcast") && settings.broadcast == BroadcastMode::reply)
        in.problem("broadcast", "no request to unit 0 is answered" + here +
                                    "; write silent or deny, or leave it out for silent");
    if (settings.retransmissions == Retransmissions::join)
        in.problem("retransmissions", "requests have no transaction id" + here +
                                          ", so none is known again; leave it out");
    if (settings.udp)
        in.problem("udp",
                   "udp is for framing: tcp, where a datagram is one ADU; leave it out" + here);
}

}  // namespace

void load_framing(MapReader& in, tcp_server::Settings& settings) {
    listener_keys().read(in, settings);
    constexpr std::string_view kAscii = "ascii";
    if (in.belongs("ascii_lower_case", "framing", std::span(&kAscii, 1)))
        in.problem("ascii_lower_case", "only a listener with framing: ascii reads hex digits");
    if (settings.framing != Framing::tcp) refuse_in_serial_modes(in, settings);
}

namespace {

using yaml::Node;

std::string endpoint_pattern(bool port_may_lack) {
    return "^([0-9]{1,3}(\\.[0-9]{1,3}){3}|\\[[0-9A-Fa-f:.]+\\])(:" +
           yaml::integer_pattern(0, 65535) + (port_may_lack ? ")?$" : ")$");
}

const std::string& network_pattern() {
    static const std::string kPattern = "^([0-9.]+(/" + yaml::integer_pattern(0, 32) +
                                        ")?|[0-9A-Fa-f.]*:[0-9A-Fa-f:.]*(/" +
                                        yaml::integer_pattern(0, 128) + ")?)$";
    return kPattern;
}

void refuse_listen(MapReader& in, std::string_view typed) {
    in.problem("listen", "listen must be ADDR:PORT such as 127.0.0.1:502 or [::1]:502, not " +
                             yaml::quote(typed) + listen_hint(typed));
}

template <class Settings>
void load_listen(MapReader& in, Settings& settings) {
    const auto text = in.text("listen");
    in.looks_like("listen", endpoint_pattern(false));
    if (!text) return;
    const auto endpoint = parse_endpoint(*text);
    if (!endpoint) return refuse_listen(in, *text);
    settings.address = endpoint->address;
    settings.port = endpoint->port;
}

/// With `tls` it may be an address alone: returns it as typed until that is known.
std::optional<std::string> load_modbus_listen(MapReader& in, tcp_server::Settings& settings) {
    const auto text = in.text("listen");
    const auto secure = parse_endpoint(text.value_or("") + ':' + std::to_string(kSecurePort));
    if (!secure) {
        load_listen(in, settings);
        in.looks_like("listen", endpoint_pattern(true));
        return std::nullopt;
    }
    in.looks_like("listen", endpoint_pattern(true));
    settings.address = secure->address;
    settings.port = secure->port;
    return text;
}

/// Returns nullptr and adds a problem at `mark` if there is none.
const Line* find_line(Loading& loading, yaml::Mark mark, const std::string& name) {
    if (const Line* line = find_line(loading.config, name)) return line;
    if (loading.names_missing) return nullptr;
    std::vector<std::string_view> names;
    names.reserve(loading.config.lines.size());
    for (const Line& line : loading.config.lines) names.push_back(line.name);
    const std::string commas = missing_commas(name);
    loading.problems.add(mark, commas.empty() ? yaml::no_such("line", name, names)
                                              : "there is no line " + yaml::quote(name) + commas);
    return nullptr;
}

void warn_of_refusals(Loading& loading, yaml::Mark mark, const Line& line) {
    loading.warn(mark, "line '" + line.name +
                           "' is only listened to (mode: listen): every request to it is refused "
                           "(0A); leave it out");
}

void load_listener_lines(Loading& loading, MapReader& in, tcp_server::Settings& settings) {
    in.looks_like("lines", name_pattern(), true);
    for (const Node* item : in.items("lines", "[floor1]", "all")) {
        const Line* line = find_line(loading, item->mark, item->scalar);
        if (line == nullptr) continue;
        if (line->listens) warn_of_refusals(loading, item->mark, *line);
        if (std::ranges::find(settings.lines, item->scalar) != settings.lines.end()) {
            loading.problems.add(item->mark, "line '" + item->scalar + "' is listed twice");
        } else {
            settings.lines.push_back(item->scalar);
        }
    }
    if (in.child("lines") != nullptr) return;
    for (const Line& line : loading.config.lines)
        if (!line.listens) settings.lines.push_back(line.name);
}

/// Finds a station of `line` by id or name; 0 is a broadcast to it.
std::optional<std::uint8_t> find_station(const Line& line, const std::string& text) {
    const auto id = yaml::parse_integer(text);
    for (const Station& known : line.stations) {
        if (known.name == text || (id && *id == known.id)) return known.id;
    }
    const bool passes = id && *id >= 0 && *id <= modbus::kMaxStation;
    if (!passes || (*id != 0 && line.refuse_unlisted)) return std::nullopt;
    return static_cast<std::uint8_t>(*id);
}

/// Warns of a station that is missing from its line's list, if the line has one.
void warn_of_unlisted(Loading& loading, yaml::Mark mark, const Line& line, std::uint8_t station) {
    const bool listed = std::ranges::count(line.stations, station, &Station::id) > 0;
    if (listed || line.stations.empty()) return;
    loading.warn(mark, "line '" + line.name + "' does not list station " + std::to_string(station) +
                           ": requests to it are passed on, and nothing is known of it; add it to "
                           "'stations', or correct the number");
}

/// Suggests the line of a station that was named without one.
std::string line_hint(const Config& config, const std::string& station) {
    for (const Line& line : config.lines) {
        for (const Station& known : line.stations) {
            if (known.name == station || std::to_string(known.id) == station)
                return "; write " + line.name + '/' + station;
        }
    }
    return "";
}

/// Parses "floor1/31" or "floor1/press" into line and station; problems at `mark`.
std::optional<tcp_server::UnitTarget> unit_target(Loading& loading, const Node& node) {
    const std::size_t slash = node.scalar.find('/');
    if (slash == std::string::npos) {
        loading.problems.add(node.mark, "a unit points to LINE/STATION such as floor1/31, not " +
                                            yaml::quote(node.scalar) +
                                            line_hint(loading.config, node.scalar));
        return std::nullopt;
    }
    const std::string name = node.scalar.substr(0, slash);
    const std::string text = node.scalar.substr(slash + 1);
    const Line* line = find_line(loading, node.mark, name);
    if (line == nullptr) return std::nullopt;
    if (line->listens) warn_of_refusals(loading, node.mark, *line);
    const auto station = find_station(*line, text);
    if (station && *station != 0) warn_of_unlisted(loading, node.mark, *line, *station);
    if (station) return tcp_server::UnitTarget{name, *station};
    if (loading.names_missing) return std::nullopt;
    std::vector<std::string_view> names;
    names.reserve(line->stations.size());
    for (const Station& known : line->stations) names.push_back(known.name);
    loading.problems.add(node.mark, "line '" + name + "' has no station " + yaml::quote(text) +
                                        did_you_mean(text, names, "stations"));
    return std::nullopt;
}

void load_units(Loading& loading, MapReader& in, tcp_server::Settings& settings) {
    const Node* map = in.map("units", "{101: floor1/31}");
    in.schema("units").keys = '^' + yaml::integer_pattern(0, 255) + '$';
    in.looks_like("units", "^[^/]+/.");
    in.refuse_empty("units", "write such as {101: floor1/31}, or leave it out");
    if (map == nullptr) return;
    for (const yaml::Entry& entry : map->entries) {
        const auto unit = yaml::parse_integer(entry.key);
        if (!unit || *unit < 0 || *unit > 255) {
            loading.problems.add(
                entry.mark, "a unit id is a number from 0 to 255, not " + yaml::quote(entry.key));
            continue;
        }
        if (const auto target = unit_target(loading, entry.value)) {
            settings.units[static_cast<std::uint8_t>(*unit)] = *target;
        }
    }
}

std::string two_lines(std::uint8_t station, const std::string& first, const std::string& second) {
    const std::string id = std::to_string(station);
    std::string text = "station " + id + " is on the lines '" + first + "' and '" + second;
    text += "' of this listener; give both a unit of their own in 'units', such as units: {101: ";
    text += first;
    text += '/' + id + ", 102: ";
    text += second;
    return text + '/' + id + '}';
}

/// `units` must distinguish a station id that is on two lines of one listener.
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
            if (added || first->second == name ||
                (aliased(name, station.id) && aliased(first->second, station.id)))
                continue;
            loading.problems.add(in.mark(), two_lines(station.id, first->second, name));
        }
    }
}

/// Returns the station of the listener's lines with this id; nullptr if there is none.
const Station* station_with_id(const Config& config, const tcp_server::Settings& settings,
                               std::int64_t id) {
    for (const std::string& name : settings.lines) {
        const std::vector<Station>& stations = find_line(config, name)->stations;
        const auto found = std::ranges::find(stations, id, &Station::id);
        if (found != stations.end()) return &*found;
    }
    return nullptr;
}

/// The gateway's own unit must not hide a station; the default one gives way to an alias and to a
/// station.
void load_diagnostics(Loading& loading, MapReader& in, tcp_server::Settings& settings) {
    in.schema("diagnostics_unit").may_be_null = true;
    const std::optional<std::uint8_t> usual = settings.diagnostics_unit;
    const bool given_way = usual && (settings.units.contains(*usual) ||
                                     station_with_id(loading.config, settings, *usual) != nullptr);
    const bool is_set = in.has("diagnostics_unit");
    if (is_set || given_way) settings.diagnostics_unit.reset();
    if (!is_set) return;
    const Node* given = in.child("diagnostics_unit");
    if (given == nullptr) return;
    constexpr std::array<std::string_view, 4> kNone{"off", "none", "no", "false"};
    if (std::ranges::find(kNone, given->scalar) != kNone.end()) {
        in.problem("diagnostics_unit",
                   "diagnostics_unit must be a whole number from 1 to 255, not " +
                       yaml::quote(given->scalar) + "; write null for none");
        return;
    }
    const auto unit = in.integer("diagnostics_unit", 1, 255);
    if (!unit) return;
    settings.diagnostics_unit = static_cast<std::uint8_t>(*unit);
    if (settings.units.contains(*settings.diagnostics_unit))
        in.problem("diagnostics_unit", "unit " + std::to_string(*unit) + " is in 'units' already");
    if (const Station* hidden = station_with_id(loading.config, settings, *unit))
        in.problem("diagnostics_unit", "diagnostics_unit " + std::to_string(*unit) +
                                           " hides station '" + hidden->name + '\'');
}

/// Keys that users write as for the serial lines of other programs.
constexpr std::array<yaml::Elsewhere, 5> kServerKeysElsewhere{
    {{"type", {}, {}, "remove it: serial lines are listed in 'lines'"},
     {"method", {}, {}, "remove it: serial lines are listed in 'lines'"},
     {"device", {}, "a line, one of 'lines'"},
     {"serial", {}, "a line, one of 'lines'"},
     {"stations", {}, "a line, one of 'lines'"}}};

tcp_server::Settings load_listener(Loading& loading, const Node& node) {
    MapReader in(node, loading.problems, "a modbus_tcp listener", "{listen: 127.0.0.1:502}");
    in.elsewhere(kServerKeysElsewhere);
    tcp_server::Settings settings;
    const std::optional<std::string> without_port = load_modbus_listen(in, settings);
    load_access(loading, in, settings);
    load_framing(in, settings);
    load_diagnostics(loading, in, settings);
    load_networks(loading, in, "allow", settings.allow);
    load_modbus_security(loading, in, settings);
    if (without_port && !settings.tls) refuse_listen(in, *without_port);
    in.finish();
    return settings;
}

}  // namespace

const Line* find_line(const Config& config, std::string_view name) {
    const auto found = std::ranges::find(config.lines, name, &Line::name);
    return found == config.lines.end() ? nullptr : &*found;
}

void load_networks(Loading& loading, MapReader& in, std::string_view key,
                   std::vector<Network>& networks) {
    in.looks_like(key, network_pattern());
    for (const Node* item : in.items(key, "[192.168.1.0/24]", "all")) {
        const auto cidr = parse_cidr(item->scalar);
        if (!cidr) {
            loading.problems.add(item->mark,
                                 std::string(key) + " lists networks such as 192.168.1.0/24, not " +
                                     yaml::quote(item->scalar) + network_hint(item->scalar, key));
            continue;
        }
        networks.push_back(*cidr);
        const std::string network = network_of(*cidr);
        if (!network.empty())
            loading.warn(item->mark, item->scalar + " is all of " + network + "; write that, or " +
                                         cidr->address + (is_ipv6(cidr->address) ? "/128" : "/32") +
                                         " for one machine");
    }
}

void load_access(Loading& loading, MapReader& in, tcp_server::Settings& settings) {
    load_listener_lines(loading, in, settings);
    load_units(loading, in, settings);
    check_overlap(loading, in, settings);
    settings.read_only = load_read_only(in).value_or(false);
    access_keys().read(in, settings);
}

void load_modbus_tcp(Loading& loading, MapReader& root) {
    for (const Node& node : root.entries("modbus_tcp", "[{listen: 127.0.0.1:502}]")) {
        tcp_server::Settings settings = load_listener(loading, node);
        const std::string name = settings.name();
        const std::string first = loading.firsts.again("listener " + name, node.mark);
        if (settings.port != 0 && !first.empty())
            loading.problems.add(node.mark, "there are two listeners on " + name + first);
        loading.config.modbus_tcp.push_back(std::move(settings));
    }
}

void load_http(Loading& loading, MapReader& root) {
    load_section(loading, root, "http", "{listen: 127.0.0.1:8080}", [&](MapReader& in) {
        web::Settings& settings = loading.config.http.emplace();
        load_listen(in, settings);
        if (auto standing = load_role(loading, in, "anonymous", true))
            settings.anonymous = std::move(*standing);
        http_keys().read(in, settings);
        load_hosts(loading, in, settings);
        load_cors(loading, in, settings.cors);
        load_networks(loading, in, "allow", settings.allow);
        load_tokens(loading, in, settings.tokens);
        settings.tls = load_tls(loading, in);
        if (settings.port != 0)
            loading.firsts.once(in, "listen", "listener " + settings.name(),
                                settings.name() + " is a modbus_tcp listener already");
    });
}

}  // namespace panelgate::config
