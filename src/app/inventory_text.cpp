#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "inventory.hpp"
#include "panelgate/config/broadcasts.hpp"
#include "panelgate/config/client_timeout.hpp"
#include "panelgate/profile/translate.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::app {
namespace {

using yaml::format_duration;

std::string rights(bool read_only) { return read_only ? "read only" : "read and write"; }

std::string text_of(const points::Point& point) {
    std::string text = "    point " + point.name + ": " + point.at;
    if (point.bit) text += " bit " + std::to_string(*point.bit);
    text += ", " + std::string(label(point.type)) + ", every " + format_duration(point.every);
    if (!point.unit.empty()) text += ", in " + point.unit;
    if (point.writable) {
        text += ", writable";
        if (point.min) text += " from " + point.min->text();
        if (point.max) text += " to " + point.max->text();
    }
    return text + '\n';
}

/// ", 5 goes out as 15, 6 goes out as 16"
std::string translations_of(const config::Station& station) {
    std::string text;
    if (!station.translate || station.guard) return text;
    for (const profile::Translation& one : profile::translations(*station.profile)) {
        text += ", " + std::to_string(one.asked) + " goes out as " + std::to_string(one.sent);
    }
    return text;
}

std::string text_of(const config::Station& station, const arbiter::StationSettings& settings) {
    std::string text = "  station " + std::to_string(station.id) + ' ' + station.name + ", " +
                       station.profile->name + ", " + rights(station.read_only);
    if (station.guard) text += ", guarded";
    if (settings.retry_writes) text += ", writes are repeated";
    if (settings.max_age > Duration::zero())
        text += ", answers up to " + format_duration(settings.max_age) + " old";
    text += translations_of(station) + '\n';
    for (const points::Point& point : station.points) text += text_of(point);
    for (const points::Poll& poll : station.polls) {
        text += "    poll " + poll.read + ", count " + std::to_string(poll.count) + ", every " +
                format_duration(poll.every) + '\n';
    }
    return text;
}

/// What a client's own timeout has to be, and what would suit those that have a short one.
std::string clients_of(const config::Line& line) {
    const config::ClientTimeout client = config::client_timeout(line);
    const std::string worst = format_duration(client.worst);
    const std::string wanted = format_duration(config::kQuickClient);
    std::string text = "  clients: every request is answered within " + worst + ", ";
    if (client.worst < config::kQuickClient)
        return text + "a timeout of " + wanted + " is enough\n";
    text += "so their timeout has to be longer";
    if (!client.quick) return text + "; " + wanted + " are too short for this wire\n";
    const config::QuickSettings& quick = *client.quick;
    text += "; for " + wanted + " set queue: {deadline: " + format_duration(quick.deadline) +
            "}, timing: {response_timeout: " + format_duration(quick.response_timeout) +
            "} and retries: " + std::to_string(quick.retries);
    if (quick.most_registers)
        text +=
            ", and read at most " + std::to_string(*quick.most_registers) + " registers at once";
    return text + '\n';
}

std::string text_of(const config::Line& line) {
    std::string text = "line " + line.name + ": " + line.device.device;
    if (line.kind != config::Line::Kind::tcp) {
        text += ", " + to_string(line.device.serial);
    } else if (line.device.serial.mode == SerialMode::ascii) {
        text += ", ASCII";
    }
    if (line.listens) text += ", only listened to";
    text += '\n';
    for (std::size_t i = 0; i < line.stations.size(); ++i)
        text += text_of(line.stations[i], line.arbiter.stations[i]);
    if (line.listens) return text;
    return text +
           "  other stations: " + (line.refuse_unlisted ? "refused" : "passed on, read and write") +
           '\n' + clients_of(line);
}

std::string text_of(const points::Relay& relay) {
    return "relay " + relay.name() + ": count " + std::to_string(relay.count) + ", every " +
           format_duration(relay.every) +
           (relay.on_change ? ", on change and every " + format_duration(relay.refresh) : "") +
           '\n';
}

std::string text_of(const std::vector<Network>& allow) {
    std::string text;
    for (const Network& network : allow) {
        text += (text.empty() ? "" : " ") + network.address + '/' + std::to_string(network.prefix);
    }
    return text.empty() ? "everybody" : text;
}

std::string text_of(const std::map<std::uint8_t, tcp_server::UnitTarget>& units) {
    std::string text;
    for (const auto& [unit, target] : units) {
        text += "  unit " + std::to_string(unit) + " is " + target.line + '/' +
                std::to_string(target.station) + '\n';
    }
    return text;
}

std::string broadcasts_of(const config::Config& config, const tcp_server::Settings& listener) {
    using Mode = tcp_server::BroadcastMode;
    if (listener.read_only || listener.broadcast == Mode::deny) return "refused";
    if (const config::Station* forbids = config::forbids_broadcasts(config, listener))
        return "refused: " + forbids->name + " is read-only";
    return listener.broadcast == Mode::silent ? "sent, and not answered" : "sent and answered";
}

std::string text_of(const config::Config& config, const tcp_server::Settings& listener) {
    std::string text = "modbus_tcp " + listener.name() + ':';
    for (const std::string& line : listener.lines) text += ' ' + line;
    if (listener.framing != modbus::Framing::tcp)
        text += ", framing " + std::string(modbus::label(listener.framing));
    if (listener.udp) text += ", udp too";
    text += ", " + rights(listener.read_only) + ", for " + text_of(listener.allow) + '\n';
    text += text_of(listener.units);
    if (listener.diagnostics_unit)
        text += "  unit " + std::to_string(*listener.diagnostics_unit) + " is the gateway itself\n";
    return text + "  broadcasts are " + broadcasts_of(config, listener) + '\n';
}

std::string text_of(const serial_server::Settings& master) {
    std::string text = "serial master " + master.name + ": " + master.device.device + ", " +
                       to_string(master.device.serial) +
                       (master.access.framing == modbus::Framing::rtu ? ", rtu:" : ":");
    for (const std::string& line : master.access.lines) text += ' ' + line;
    const bool silent = master.on_failure == serial_server::OnFailure::silence;
    text += ", " + rights(master.access.read_only) + ", told of failures by " +
            (silent ? "silence" : "exceptions") + '\n';
    return text + text_of(master.access.units);
}

std::string text_of(web::Role role) {
    switch (role) {
        case web::Role::none:
            return "nothing";
        case web::Role::viewer:
            return "read";
        case web::Role::operator_:
            return "read and write";
    }
    std::abort();
}

std::string text_of(const web::Settings& http) {
    std::string text = "http " + http.name() + ": without a token " + text_of(http.anonymous) +
                       ", for " + text_of(http.allow);
    if (!http.hosts.empty()) text += ", as";
    for (const std::string& host : http.hosts) text += ' ' + host;
    text += '\n';
    for (const web::Token& token : http.tokens)
        text += "  token " + token.name + ": " + text_of(token.role) + '\n';
    return text;
}

std::string text_of(const mqtt::Settings& mqtt) {
    const bool json = mqtt.format == mqtt::Format::json;
    return "mqtt " + mqtt.broker() + ": " + (json ? "json below " + mqtt.topic : "sparkplug") +
           ", " + std::to_string(mqtt.store) + " changes are kept while it is away, points are " +
           (mqtt.write ? "read and written\n" : "read\n");
}

}  // namespace

std::string inventory_text(const config::Config& config) {
    std::string text;
    for (const config::Line& line : config.lines) text += text_of(line);
    for (const points::Relay& relay : config.relays) text += text_of(relay);
    for (const tcp_server::Settings& listener : config.modbus_tcp)
        text += text_of(config, listener);
    for (const serial_server::Settings& master : config.serial_masters) text += text_of(master);
    if (config.http) text += text_of(*config.http);
    if (config.mqtt) text += text_of(*config.mqtt);
    return text;
}

}  // namespace panelgate::app
