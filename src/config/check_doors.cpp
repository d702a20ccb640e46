// Checks of what listeners let in.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/config/config.hpp"
#include "panelgate/config/deadlines.hpp"
#include "panelgate/config/endpoint.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

/// Returns the first control character: C0 except the tab, DEL, C1 (in UTF-8: C2 80 to C2 9F), or
/// one of the two separators that end a line in a browser.
std::optional<unsigned> control_character(std::string_view text) {
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto byte = static_cast<unsigned char>(text[i]);
        const auto next = static_cast<unsigned char>(i + 1 < text.size() ? text[i + 1] : 0);
        if ((byte < 0x20 && byte != '\t') || byte == 0x7F) return byte;
        if (byte == 0xC2 && next < 0xA0) return next;
        if (text.substr(i).starts_with("\u2028")) return 0x2028;
        if (text.substr(i).starts_with("\u2029")) return 0x2029;
    }
    return std::nullopt;
}

/// True if a block text begins like a list or a map.
bool is_yaml(std::string_view text) {
    const std::string_view first = text.substr(0, text.find('\n'));
    const std::size_t colon = first.find(':');
    const bool is_key =
        colon != first.npos && colon > 0 &&
        first.substr(0, colon).find_first_not_of("abcdefghijklmnopqrstuvwxyz_") == first.npos &&
        (colon + 1 == first.size() || first[colon + 1] == ' ');
    return first.starts_with("- ") || is_key;
}

/// `variable`: the variable that supplied the text, or "".
void refuse(std::string_view text, yaml::Mark mark, const std::string& variable,
            yaml::Problems& problems) {
    const auto control = control_character(text);
    if (!control) return;
    const std::string in = variable.empty() ? " in a text" : " in the value of ${" + variable + '}';
    if (*control == '\n' && is_yaml(text)) {
        problems.add(mark,
                     "a text, because of the '|' or '>' after the key; remove that sign to have a "
                     "list, or keys, below");
        return;
    }
    if (*control == '\n') {
        problems.add(mark, variable.empty() ? "a text of more than one line; write it on one line"
                                            : "a line break" + in + "; give the variable one line");
        return;
    }
    std::array<char, 16> name{};
    std::snprintf(name.data(), name.size(), "U+%04X", *control);
    problems.add(mark, "control character " + std::string(name.data()) + in + "; leave it out");
}

}  // namespace

void refuse_control_characters(const yaml::Node& tree, yaml::Problems& problems) {
    refuse(tree.scalar, tree.mark, tree.variable, problems);
    for (const yaml::Node& item : tree.items) refuse_control_characters(item, problems);
    for (const yaml::Entry& entry : tree.entries) {
        refuse(entry.key, entry.mark, {}, problems);
        refuse_control_characters(entry.value, problems);
    }
}

namespace {

using tcp_server::UnitTarget;
using yaml::Mark;
using yaml::Node;

/// Mark of the key's value, or of the map if it is absent.
Mark mark_of(const Node& map, std::string_view key) {
    const Node* value = map.find(key);
    return value != nullptr ? value->mark : map.mark;
}

const Station* station_of(const Config& config, const UnitTarget& target) {
    const std::vector<Station>& stations = find_line(config, target.line)->stations;
    const auto found = std::ranges::find(stations, target.station, &Station::id);
    return found == stations.end() ? nullptr : &*found;
}

/// Returns a unit id that is not in use.
std::string free_unit(const tcp_server::Settings& listener) {
    int unit = 101;
    while (unit < 247 && listener.units.contains(static_cast<std::uint8_t>(unit))) ++unit;
    return std::to_string(unit);
}

bool can_write(const Config& config, const tcp_server::Settings& listener) {
    const auto writable = [&](const std::string& name) {
        const Line& line = *find_line(config, name);
        const bool passes = !line.refuse_unlisted && listener.lines.size() == 1;
        return passes || !std::ranges::all_of(line.stations, &Station::read_only);
    };
    return !listener.read_only && std::ranges::any_of(listener.lines, writable);
}

/// A listener and where it is configured.
struct ListenAddress {
    Mark mark;
    std::string address;
    std::uint16_t port = 0;
    std::string name;
};

bool takes(const ListenAddress& all, const ListenAddress& other) {
    const bool same_family = is_ipv6(all.address) == is_ipv6(other.address);
    return same_family && all.port != 0 && all.port == other.port && is_any_address(all.address);
}

void warn_of_ports(Loading& loading, const std::vector<ListenAddress>& listeners) {
    for (std::size_t i = 0; i < listeners.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
            const bool later_is_all = takes(listeners[i], listeners[j]);
            if (!later_is_all && !takes(listeners[j], listeners[i])) continue;
            const ListenAddress& all = later_is_all ? listeners[i] : listeners[j];
            const ListenAddress& one = later_is_all ? listeners[j] : listeners[i];
            loading.warn(listeners[i].mark,
                         all.name + " (line " + std::to_string(all.mark.line) + ") takes port " +
                             std::to_string(all.port) + " of every address, that of " + one.name +
                             " (line " + std::to_string(one.mark.line) +
                             ") too: only one of them can be opened; leave one out, or give it "
                             "another port");
        }
    }
}

/// Returns " in 0.0.0.0/1, 128.0.0.0/1"; "" for an empty list.
std::string in_networks(const std::vector<Network>& allow) {
    constexpr std::size_t kNamed = 4;
    if (allow.size() > kNamed)
        return " in the " + std::to_string(allow.size()) + " networks of allow";
    std::string text;
    for (const Network& network : allow)
        text += (text.empty() ? " in " : ", ") + network_text(network);
    return text;
}

/// Returns "any client that reaches port 502 of any address".
template <class Listener>
std::string whoever_reaches(const Listener& listener) {
    const std::string port = "port " + std::to_string(listener.port) + " of any address";
    return "any client" + in_networks(listener.allow) + " that reaches " +
           (is_any_address(listener.address) ? port : listener.name());
}

void warn_of_open_listener(Loading& loading, const Node& node,
                           const tcp_server::Settings& listener) {
    if (!is_reachable_from_outside(listener.address, listener.allow)) return;
    if (listener.tls && listener.tls->client == tls::ClientCertificate::required) return;
    if (!can_write(loading.config, listener)) return;
    loading.warn(mark_of(node, "listen"),
                 whoever_reaches(listener) +
                     " may write to the panels; list the networks that may, such as "
                     "allow: [192.168.10.0/24], or set access: read_only, or listen on 127.0.0.1:" +
                     std::to_string(listener.port));
}

/// A UDP sender address can be forged: the answers go to the forged address.
void warn_of_open_udp(Loading& loading, const Node& node, const tcp_server::Settings& listener) {
    if (!listener.udp || !is_reachable_from_outside(listener.address, listener.allow)) return;
    const std::string place = is_any_address(listener.address) ? "all addresses" : listener.name();
    const std::string whom =
        listener.allow.empty() ? "" : " for clients" + in_networks(listener.allow);
    loading.warn(mark_of(node, "udp"),
                 "udp: true on " + place + whom +
                     " answers datagrams whose sender may be forged, with up to twenty times what "
                     "was sent; list the networks that may ask, such as allow: [192.168.10.0/24], "
                     "or listen on 127.0.0.1:" +
                     std::to_string(listener.port));
}

/// One read-only station forbids broadcasts for all; no warning where nothing can be written
/// anyway.
void warn_of_broadcasts(Loading& loading, const Node& node, const tcp_server::Settings& listener) {
    const bool sends = listener.broadcast != tcp_server::BroadcastMode::deny;
    if (!sends || !can_write(loading.config, listener)) return;
    const Station* forbids = forbids_broadcasts(loading.config, listener);
    if (forbids == nullptr) return;
    loading.warn(mark_of(node, "listen"),
                 "every broadcast through " + listener.name() +
                     " is refused (01): it would reach '" + forbids->name +
                     "', which is read_only; say broadcast: deny if that is meant, or serve its "
                     "line by another listener");
}

/// Warns if a unit hides the station of the same id, or if two units seem swapped.
void warn_of_unit(Loading& loading, const Node& node, const tcp_server::Settings& listener,
                  std::uint8_t unit, const UnitTarget& target) {
    const Station* reached = station_of(loading.config, target);
    if (reached == nullptr || reached->id == unit) return;
    for (const std::string& line : listener.lines) {
        const Station* hidden = station_of(loading.config, {line, unit});
        if (hidden == nullptr) continue;
        const auto is_hidden = [&](const auto& other) {
            return other.second.line == line && other.second.station == unit;
        };
        const auto other = std::ranges::find_if(listener.units, is_hidden);
        const auto named = [](const Station& station) {
            return '\'' + station.name + "' (station " + std::to_string(station.id) + ')';
        };
        const std::string text = "unit " + std::to_string(unit) + " is " + named(*reached);
        const Mark mark = mark_of(*node.find("units"), std::to_string(unit));
        if (other == listener.units.end()) {
            loading.warn(mark, text + ", so no unit is " + named(*hidden) +
                                   "; give it one, such as " + free_unit(listener) + ": " + line +
                                   '/' + hidden->name);
        } else if (other->first == reached->id && unit < other->first) {
            loading.warn(mark, text + " and unit " + std::to_string(other->first) + " is " +
                                   named(*hidden) +
                                   ": swapped? Without 'units' each station has its own id");
        }
    }
}

/// Docker and Podman mount secrets there for one container, readable by all in it.
bool is_container_secret(std::string_view path) {
    return path.starts_with("/run/secrets/") || path.starts_with("/var/run/secrets/");
}

void warn_of_token(Loading& loading, const Node& node, const web::Token& token) {
    const Node* file = node.find("file");
    if (token.characters > 0 && token.characters < kShortToken)
        loading.warn(file->mark, "the token in " + file->scalar + " has " +
                                     std::to_string(token.characters) + " characters; take " +
                                     std::to_string(kShortToken) +
                                     " or more, such as of `openssl rand -hex 16`");
    if (is_container_secret(file->scalar)) return;
    if (loading.files.is_readable_by_all(file->scalar))
        loading.warn(file->mark, "every user of this machine can read the token file " +
                                     file->scalar + "; `chmod o-r " + file->scalar +
                                     "`, or a secret of the container platform in /run/secrets");
}

/// `panelgate health`, and with it the image's HEALTHCHECK, connects from the listener's own
/// address.
void warn_of_health(Loading& loading, const Node& node, const web::Settings& http) {
    const std::string own = reachable(http.address);
    const auto holds = [&](const Network& network) {
        return is_in(own, network.address, network.prefix);
    };
    if (http.allow.empty() || std::ranges::any_of(http.allow, holds)) return;
    loading.warn(
        mark_of(node, "allow"),
        "this machine itself (" + own +
            ") is not let in, so `panelgate health` and `panelgate reload` cannot ask; add " + own +
            (is_ipv6(own) ? "/128" : "/32"));
}

void warn_of_plain_tokens(Loading& loading, const Node& node, const web::Settings& http) {
    const auto is_here = [&http](const Network& network) {
        const bool is_host = network.prefix == (is_ipv6(network.address) ? 128 : 32);
        if (is_host && network.address == http.address) return true;
        return is_loopback(network.address) && (is_host || network.prefix >= 8);
    };
    const bool only_here = !http.allow.empty() && std::ranges::all_of(http.allow, is_here);
    if (http.tokens.empty() || http.tls || is_loopback(http.address) || only_here) return;
    loading.warn(mark_of(node, "tokens"),
                 "tokens are sent in plain text to " + http.name() +
                     ": anyone on the network path can read and use them; give http: tls "
                     "(`panelgate cert` makes its files), or listen on "
                     "127.0.0.1:" +
                     std::to_string(http.port) + " behind a proxy with TLS, or a VPN");
}

/// Warns of what anybody may do without a token.
void warn_of_anonymous(Loading& loading, const Node& node, const web::Settings& http) {
    if (!is_reachable_from_outside(http.address, http.allow)) return;
    if (http.tls && http.tls->client == tls::ClientCertificate::required) return;
    // Anybody is a viewer by default: then the address is what was typed.
    const bool typed = node.find("anonymous") != nullptr;
    const Mark mark = mark_of(node, typed ? "anonymous" : "listen");
    const std::string instead =
        ", or list the networks that may, such as allow: [192.168.10.0/24], or listen on "
        "127.0.0.1:" +
        std::to_string(http.port);
    if (http.anonymous.role == Role::viewer)
        loading.warn(mark, whoever_reaches(http) +
                               " may see the configuration, all values and every frame, and read "
                               "on the bus, without a token; set anonymous: none and give readers "
                               "a token" +
                               instead);
    if (http.anonymous.role >= Role::operator_)
        loading.warn(mark, whoever_reaches(http) +
                               " may write to the panels without a token; set anonymous: viewer "
                               "and give writers a token" +
                               instead);
}

/// Probes show no certificate.
void warn_of_required_certificates(Loading& loading, const Node& node, const web::Settings& http) {
    if (!http.tls || http.tls->client != tls::ClientCertificate::required) return;
    loading.warn(
        mark_of(node, "tls"),
        "client: required shuts out probes and `panelgate health`, which have no "
        "certificate; client: optional with anonymous: none lets only them in without one");
}

void warn_of_http(Loading& loading, const Node& node, const web::Settings& http) {
    warn_of_required_certificates(loading, node, http);
    warn_of_health(loading, node, http);
    warn_of_plain_tokens(loading, node, http);
    warn_of_anonymous(loading, node, http);
    const bool is_open = !http.tokens.empty() || tls::goes_by_certificates(http.tls);
    if (http.anonymous.role == Role::none && !is_open)
        loading.warn(mark_of(node, "anonymous"),
                     "clients can use only /healthz and /readyz: anonymous is none and there is no "
                     "token; add tokens, or set anonymous: viewer");
    const Node* tokens = node.find("tokens");
    for (std::size_t i = 0; i < http.tokens.size(); ++i)
        warn_of_token(loading, tokens->items[i], http.tokens[i]);
}

}  // namespace

void warn_of_listeners(Loading& loading, const Node& tree) {
    std::vector<ListenAddress> listeners;
    for (std::size_t i = 0; i < loading.config.modbus_tcp.size(); ++i) {
        const Node& node = tree.find("modbus_tcp")->items[i];
        const tcp_server::Settings& listener = loading.config.modbus_tcp[i];
        listeners.push_back(
            {mark_of(node, "listen"), listener.address, listener.port, listener.name()});
        warn_of_open_listener(loading, node, listener);
        warn_of_open_udp(loading, node, listener);
        warn_of_broadcasts(loading, node, listener);
        for (const auto& [unit, target] : listener.units)
            warn_of_unit(loading, node, listener, unit, target);
    }
    if (loading.config.http) {
        const web::Settings& http = *loading.config.http;
        const Node& node = *tree.find("http");
        listeners.push_back({mark_of(node, "listen"), http.address, http.port, http.name()});
        warn_of_http(loading, node, http);
    }
    warn_of_ports(loading, listeners);
}

}  // namespace panelgate::config
