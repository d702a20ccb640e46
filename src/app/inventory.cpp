#include "inventory.hpp"

#include <boost/json/array.hpp>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/config/deadlines.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/profile/judge.hpp"
#include "panelgate/yaml/map_reader.hpp"
#include "rights_text.hpp"

namespace panelgate::app {

namespace {

namespace json = boost::json;

std::int64_t milliseconds(Duration duration) {
    return std::chrono::duration_cast<std::chrono::milliseconds>(duration).count();
}

std::string_view access(bool read_only) { return read_only ? "read_only" : "read_write"; }

/// An array of `make` applied to each element.
template <class List, class Make>
json::array each(const List& list, const Make& make) {
    json::array made;
    for (const auto& one : list) made.push_back(make(one));
    return made;
}

json::object point_json(const points::Point& point) {
    json::object made{{"name", point.name},
                      {"at", point.at},
                      {"type", label(point.type)},
                      {"every_ms", milliseconds(point.every)},
                      {"writable", point.writable}};
    if (!point.unit.empty()) made["unit"] = point.unit;
    return made;
}

json::object station_json(const config::Station& station,
                          const arbiter::StationSettings& settings) {
    return {{"id", station.id},
            {"name", station.name},
            {"profile", station.profile->name},
            {"access", access(station.read_only)},
            {"guard", station.guard},
            {"translate", station.translate ? "auto" : "off"},
            {"crc_order", label(settings.crc_order)},
            {"retries", settings.retries},
            {"retry_writes", settings.retry_writes},
            {"max_age_ms", milliseconds(settings.max_age)},
            {"points", each(station.points, point_json)}};
}

json::object clients_json(const config::Line& line) {
    const config::ClientTimeout client = config::client_timeout(line);
    json::object made{{"answered_within_ms", milliseconds(client.worst)}};
    if (!client.quick) return made;
    json::object quick{{"deadline_ms", milliseconds(client.quick->deadline)},
                       {"response_timeout_ms", milliseconds(client.quick->response_timeout)},
                       {"retries", client.quick->retries}};
    if (client.quick->most_registers) quick["most_registers"] = *client.quick->most_registers;
    made["within_500_ms"] = std::move(quick);
    return made;
}

json::object line_json(const config::Line& line) {
    json::array stations;
    json::array polls;
    for (std::size_t i = 0; i < line.stations.size(); ++i) {
        const config::Station& station = line.stations[i];
        stations.push_back(station_json(station, line.arbiter.stations[i]));
        for (const points::Poll& poll : station.polls) {
            polls.push_back(json::object{{"station", station.name},
                                         {"read", poll.read},
                                         {"count", poll.count},
                                         {"every_ms", milliseconds(poll.every)}});
        }
    }
    return {{"name", line.name},
            {"device", line.device.device},
            {"mode", line.listens ? "listen" : "master"},
            {"serial", to_string(line.device.serial)},
            {"clients", clients_json(line)},
            {"unlisted_stations", line.refuse_unlisted ? "refuse" : "pass"},
            {"stations", std::move(stations)},
            {"polls", std::move(polls)}};
}

json::object relay_json(const points::Relay& relay) {
    return {{"from", relay.from.station + '/' + relay.from.at},
            {"to", relay.to.station + '/' + relay.to.at},
            {"count", relay.count},
            {"every_ms", milliseconds(relay.every)},
            {"on_change", relay.on_change},
            {"refresh_ms", milliseconds(relay.refresh)}};
}

json::value text_json(const std::string& text) { return json::value(text); }

json::value network_json(const Network& network) {
    return json::value(config::network_text(network));
}

json::value unit_json(std::optional<std::uint8_t> unit) {
    return unit ? json::value(*unit) : json::value(nullptr);
}

const char* word(tcp_server::BroadcastMode mode) {
    switch (mode) {
        case tcp_server::BroadcastMode::reply:
            return "reply";
        case tcp_server::BroadcastMode::silent:
            return "silent";
        case tcp_server::BroadcastMode::deny:
            return "deny";
    }
    std::abort();
}

json::object units_json(const tcp_server::Settings& access) {
    json::object units;
    for (const auto& [unit, target] : access.units)
        units[std::to_string(unit)] = target.line + '/' + std::to_string(target.station);
    return units;
}

json::object master_json(const serial_server::Settings& master) {
    const bool silent = master.on_failure == serial_server::OnFailure::silence;
    return {{"name", master.name},
            {"device", master.device.device},
            {"serial", to_string(master.device.serial)},
            {"framing", modbus::label(master.access.framing)},
            {"lines", each(master.access.lines, text_json)},
            {"units", units_json(master.access)},
            {"access", access(master.access.read_only)},
            {"on_failure", silent ? "silence" : "exception"}};
}

std::string_view word(tls::ClientCertificate client) {
    switch (client) {
        case tls::ClientCertificate::none:
            return "none";
        case tls::ClientCertificate::optional:
            return "optional";
        case tls::ClientCertificate::required:
            return "required";
    }
    std::abort();
}

json::value tls_json(const std::optional<tls::Settings>& tls) {
    if (!tls) return nullptr;
    return json::object{{"certificate", tls->certificate},
                        {"client", word(tls->client)},
                        {"role_from", tls->role_from_certificate ? "certificate" : ""}};
}

json::object listener_json(const tcp_server::Settings& listener) {
    return {{"listen", listener.name()},
            {"framing", modbus::label(listener.framing)},
            {"udp", listener.udp},
            {"lines", each(listener.lines, text_json)},
            {"units", units_json(listener)},
            {"diagnostics_unit", unit_json(listener.diagnostics_unit)},
            {"broadcast", word(listener.broadcast)},
            {"access", access(listener.read_only)},
            {"allow", each(listener.allow, network_json)},
            {"tls", tls_json(listener.tls)}};
}

json::object http_json(const web::Settings& http) {
    const auto token = [](const web::Token& one) {
        return json::object{{"name", one.name}, {"role", label(one.role)}};
    };
    return {{"listen", http.name()},
            {"anonymous", label(http.anonymous)},
            {"tokens", each(http.tokens, token)},
            {"hosts", each(http.hosts, text_json)},
            {"allow", each(http.allow, network_json)},
            {"tls", tls_json(http.tls)}};
}

json::object mqtt_json(const mqtt::Settings& mqtt) {
    return {{"broker", mqtt.broker()},
            {"format", label(mqtt.format)},
            {"topic", mqtt.topic},
            {"store", mqtt.store},
            {"write", mqtt.write ? "points" : "none"}};
}

}  // namespace

json::object inventory_json(const config::Config& config) {
    json::object made{{"lines", each(config.lines, line_json)},
                      {"relays", each(config.relays, relay_json)},
                      {"modbus_tcp", each(config.modbus_tcp, listener_json)}};
    if (!config.serial_masters.empty())
        made["serial_masters"] = each(config.serial_masters, master_json);
    if (config.http) made["http"] = http_json(*config.http);
    if (config.mqtt) made["mqtt"] = mqtt_json(*config.mqtt);
    if (!config.access.is_open()) made["access"] = access_json(config);
    return made;
}

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
    if (settings.crc_order != modbus::CrcOrder::low_first) text += ", CRC high byte first";
    if (settings.retries != arbiter::StationSettings().retries)
        text += ", reads are repeated up to " + std::to_string(settings.retries) + " times";
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

/// The timeout that clients need, and settings that would suit clients with a short one.
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
    for (const Network& network : allow)
        text += (text.empty() ? "" : " ") + config::network_text(network);
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

std::string text_of(const std::optional<tls::Settings>& tls) {
    if (!tls) return "";
    return ", TLS, certificates of clients " + std::string(word(tls->client));
}

std::string text_of(const config::Config& config, const tcp_server::Settings& listener) {
    std::string text = "modbus_tcp " + listener.name() + ':';
    for (const std::string& line : listener.lines) text += ' ' + line;
    if (listener.framing != modbus::Framing::tcp)
        text += ", framing " + std::string(modbus::label(listener.framing));
    if (listener.udp) text += ", udp too";
    text += text_of(listener.tls) + ", " + rights(listener.read_only) + ", for " +
            text_of(listener.allow) + '\n';
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
    text += ", " + rights(master.access.read_only) + ", failures reported by " +
            (silent ? "silence" : "exceptions") + '\n';
    return text + text_of(master.access.units);
}

std::string text_of(Role role) {
    switch (role) {
        case Role::none:
            return "nothing";
        case Role::viewer:
            return "read";
        case Role::operator_:
            return "read and write";
        case Role::engineer:
            return "read, write, raw, broadcast, discover and simulator";
        case Role::admin:
            return "everything";
    }
    std::abort();
}

std::string text_of(const web::Settings& http) {
    std::string text = "http " + http.name() + ": without a token " + text_of(http.anonymous) +
                       ", for " + text_of(http.allow) + text_of(http.tls);
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
    return text + rights_matrix(config);
}

}  // namespace panelgate::app
