#include <boost/json/array.hpp>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string_view>
#include <utility>

#include "inventory.hpp"
#include "panelgate/config/client_timeout.hpp"

namespace panelgate::app {
namespace {

namespace json = boost::json;

std::int64_t milliseconds(Duration duration) {
    return std::chrono::duration_cast<std::chrono::milliseconds>(duration).count();
}

std::string_view access(bool read_only) { return read_only ? "read_only" : "read_write"; }

/// An array of what `make` makes of each.
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
    return json::value(network.address + '/' + std::to_string(network.prefix));
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

json::object listener_json(const tcp_server::Settings& listener) {
    return {{"listen", listener.name()},
            {"framing", modbus::label(listener.framing)},
            {"udp", listener.udp},
            {"lines", each(listener.lines, text_json)},
            {"units", units_json(listener)},
            {"diagnostics_unit", unit_json(listener.diagnostics_unit)},
            {"broadcast", word(listener.broadcast)},
            {"access", access(listener.read_only)},
            {"allow", each(listener.allow, network_json)}};
}

json::object http_json(const web::Settings& http) {
    const auto token = [](const web::Token& one) {
        return json::object{{"name", one.name}, {"role", label(one.role)}};
    };
    return {{"listen", http.name()},
            {"anonymous", label(http.anonymous)},
            {"tokens", each(http.tokens, token)},
            {"hosts", each(http.hosts, text_json)},
            {"allow", each(http.allow, network_json)}};
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
    return made;
}

}  // namespace panelgate::app
