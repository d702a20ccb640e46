// Refusals of a listener before rights are judged: networks, lines, access, broadcasts.
#include "panelgate/explain/explain_door.hpp"

#include <algorithm>

#include "panelgate/config/endpoint.hpp"
#include "panelgate/explain/doors.hpp"
#include "panelgate/rt/acceptor.hpp"

namespace panelgate::explain {

namespace {

using access::Act;

bool may_come(const std::vector<Network>& allow, const std::string& address) {
    return allow.empty() || lets_in(rt::AccessList(allow), address);
}

std::string refused_by(const config::Config& config, const tcp_server::Settings& listener,
                       const std::string& name, const AtDoor& request, Unlisted unlisted) {
    if (!may_come(listener.allow, request.who.address))
        return name + " does not let " + request.who.address + " in (allow)";
    const std::uint8_t station = request.act == Act::broadcast ? 0 : request.station.id;
    if (!leads_to(destinations_of(listener, config, unlisted), request.line.name, station))
        return name + " does not serve line '" + request.line.name + "'";
    if (request.writes && listener.read_only) return name + " has access: read_only";
    if (request.act == Act::broadcast && listener.broadcast == tcp_server::BroadcastMode::deny)
        return name + " has broadcast: deny";
    return "";
}

std::string ended_token(const config::Config& config, const Who& who, WallTime now) {
    if (who.token.empty() || !config.http) return "";
    const auto& tokens = config.http->tokens;
    const auto token = std::ranges::find(tokens, who.token, &web::Token::name);
    if (token == tokens.end() || !token->has_expired(now)) return "";
    return "the token '" + who.token + "' ended on " + web::expiry_text(*token->expires);
}

}  // namespace

std::optional<Face> face_by(const config::Config& config, const std::string& listener) {
    const auto is_it = [&](const auto& one) { return one.name() == listener; };
    if (std::ranges::any_of(config.modbus_tcp, is_it)) return Face::modbus_tcp;
    if (config.http && config.http->name() == listener) return Face::http;
    if (config.mqtt && config.mqtt->broker() == listener) return Face::mqtt;
    const bool master = std::ranges::any_of(config.serial_masters,
                                            [&](const auto& one) { return one.name == listener; });
    return master ? std::optional(Face::serial_master) : std::nullopt;
}

std::string listener_names(const config::Config& config) {
    std::vector<std::string> names;
    for (const auto& one : config.modbus_tcp) names.push_back(one.name());
    for (const auto& one : config.serial_masters) names.push_back(one.name);
    if (config.http) names.push_back(config.http->name());
    if (config.mqtt) names.push_back(config.mqtt->broker());
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
    return text.empty() ? "none" : text;
}

bool is_address(const std::string& text) {
    return text.find('/') == text.npos && config::parse_cidr(text).has_value();
}

std::string refused_at_door(const config::Config& config, const AtDoor& request, WallTime now) {
    const Who& who = request.who;
    if (std::string why = ended_token(config, who, now); !why.empty()) return why;
    if (who.face == Face::http && config.http && !may_come(config.http->allow, who.address))
        return "http does not let " + who.address + " in (allow)";
    if (who.face == Face::mqtt && config.mqtt && request.writes && !config.mqtt->write)
        return "mqtt has no write: points";
    for (const tcp_server::Settings& listener : config.modbus_tcp) {
        if (listener.name() != who.listener) continue;
        return refused_by(config, listener, "the listener " + who.listener, request,
                          Unlisted::as_the_line);
    }
    for (const serial_server::Settings& master : config.serial_masters) {
        if (master.name != who.listener) continue;
        return refused_by(config, master.access, "the serial master " + who.listener, request,
                          Unlisted::refused);
    }
    return "";
}

}  // namespace panelgate::explain
