#include <array>
#include <optional>

#include "held.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::app {
namespace {

template <class List, class Word>
std::string listed(const List& list, const Word& word) {
    std::string text;
    for (const auto& one : list) text += (text.empty() ? "" : ", ") + word(one);
    return '[' + text + ']';
}

std::string word(const std::string& text) { return text; }

std::string networks(const std::vector<Network>& allow) {
    if (allow.empty()) return "all";
    return listed(allow, [](const Network& network) {
        return network.address + '/' + std::to_string(network.prefix);
    });
}

/// What listeners and serial masters have.
void hold_access(Holder& held, const tcp_server::Settings& settings) {
    constexpr std::array<const char*, 3> kBroadcast{"reply", "silent", "deny"};
    held.tell("lines", listed(settings.lines, word));
    Holder units = held.below("units");
    for (const auto& [unit, target] : settings.units)
        units.tell(std::to_string(unit), target.line + '/' + std::to_string(target.station));
    held.tell("access", settings.read_only ? "read_only" : "read_write");
    held.tell("framing", modbus::label(settings.framing));
    held.tell("broadcast", kBroadcast[static_cast<std::size_t>(settings.broadcast)]);
}

void hold_listener(const Holder& top, const std::string& name,
                   const tcp_server::Settings& settings) {
    constexpr std::array<const char*, 3> kRetransmissions{"join writes", "join", "pass"};
    Holder held = top.item("modbus_tcp", name);
    hold_access(held, settings);
    const bool any_case = settings.ascii_digits == modbus::HexDigits::any_case;
    held.tell("ascii_lower_case", any_case ? "take" : "refuse");
    held.tell("udp", settings.udp);
    held.tell("retransmissions",
              kRetransmissions[static_cast<std::size_t>(settings.retransmissions)]);
    const auto& unit = settings.diagnostics_unit;
    held.tell("diagnostics_unit", unit ? std::to_string(*unit) : "null");
    held.tell("allow", networks(settings.allow));
    held.tell("max_connections", settings.max_connections);
    held.tell("max_connections_per_address", settings.max_connections_per_address);
}

void hold_master(const Holder& top, const serial_server::Settings& settings) {
    constexpr std::array<const char*, 3> kEcho{"auto", "on", "off"};
    const bool silent = settings.on_failure == serial_server::OnFailure::silence;
    Holder held = top.item("serial_masters", settings.name);
    hold_port(held, settings.device);
    hold_access(held, settings.access);
    held.tell("on_failure", silent ? "silence" : "exception");
    held.tell("echo", kEcho[static_cast<std::size_t>(settings.echo)]);
    const auto& timeout = settings.response_timeout;
    held.tell("response_timeout", timeout ? yaml::format_duration(*timeout) : "none");
}

void hold_http(const Holder& top, const web::Settings& settings) {
    Holder held = top.item("http");
    held.tell("listen", settings.name());
    held.tell("anonymous", label(settings.anonymous));
    held.tell("hosts", settings.hosts.empty() ? "the machine's" : listed(settings.hosts, word));
    held.tell("allow", networks(settings.allow));
    held.tell("max_connections_per_address", settings.max_connections_per_address);
    for (const web::Token& token : settings.tokens) {
        Holder one = held.item("tokens", token.name);
        one.tell("role", label(token.role));
        one.tell_secret("secret", token.secret);
    }
}

void hold_mqtt(const Holder& top, const mqtt::Settings& settings) {
    const auto or_default = [](const std::string& text) {
        return text.empty() ? std::string("default") : text;
    };
    Holder held = top.item("mqtt");
    held.tell("broker", settings.broker());
    held.tell("format", label(settings.format));
    held.tell("topic", settings.topic);
    held.tell("group", or_default(settings.group));
    held.tell("node", or_default(settings.node));
    held.tell("client_id", or_default(settings.client_id));
    held.tell("username", or_default(settings.username));
    held.tell_secret("password", settings.password);
    held.tell("write", settings.write ? "points" : "none");
    held.tell("qos", settings.qos);
    held.tell("keep_alive", settings.keep_alive);
    held.tell("ca", or_default(settings.ca));
    held.tell("certificate", or_default(settings.certificate));
    held.tell("key", or_default(settings.key));
    held.tell("store", settings.store);
}

}  // namespace

void hold_servers(const Holder& top, const config::Config& config) {
    Distinct listeners;
    for (const tcp_server::Settings& settings : config.modbus_tcp)
        hold_listener(top, listeners.name(settings.name()), settings);
    for (const serial_server::Settings& settings : config.serial_masters)
        hold_master(top, settings);
    if (config.http) hold_http(top, *config.http);
    if (config.mqtt) hold_mqtt(top, *config.mqtt);
    for (const points::Relay& relay : config.relays) {
        Holder held = top.item("relays", relay.name());
        held.tell("count", std::size_t{relay.count});
        held.tell("every", relay.every);
        held.tell("on_change", relay.on_change);
        held.tell("refresh", relay.refresh);
    }
}

}  // namespace panelgate::app
