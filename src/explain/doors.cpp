#include "panelgate/explain/doors.hpp"

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <boost/system/error_code.hpp>
#include <string_view>
#include <utility>

#include "panelgate/base/role.hpp"
#include "panelgate/tcp_server/unit_map.hpp"

namespace panelgate::explain {

namespace {

using bus::Admission;

Admission out(const WhoRef& who, std::string_view rule, std::string_view why) {
    return {.who = who, .rule = rule, .why = why};
}

Admission not_allowed(const WhoRef& who) {
    return out(who, "allow", "its address is not in the allow list any more");
}

/// With another role than he came in with.
Admission with(const WhoRef& who, Standing standing) {
    Who now = *who;
    now.standing = std::move(standing);
    panelgate::Rights may =
        now.standing.own ? now.standing.own->rights : rights_of(now.standing.role);
    return {.who = make_who(std::move(now)), .may = may};
}

panelgate::Rights rights(std::initializer_list<Right> all) {
    panelgate::Rights made;
    for (const Right right : all) made.add(right);
    return made;
}

Admission only_reads(const WhoRef& who, std::string_view rule, std::string_view why) {
    return {.who = who, .may = rights({Right::read}), .rule = rule, .why = why};
}

/// As web::standing_of(): by the certificate where the listener goes by that.
Standing standing_without_token(const Who& who, const web::Settings& http) {
    if (who.certificate.empty() || !tls::goes_by_certificates(http.tls)) return http.anonymous;
    Standing named = standing_named(who.certificate_role, http.tls->own_roles);
    return named == Standing{} ? only_reading(http.anonymous) : named;
}

}  // namespace

bool lets_in(const rt::AccessList& allow, const std::string& address) {
    boost::system::error_code none;
    const auto peer = boost::asio::ip::make_address(address, none);
    return address.empty() || (!none && allow.allows(peer));
}

namespace {

/// An image leads to the stations of its points.
void add_station(const config::Config& config, std::string_view name, Destinations& reach) {
    for (const config::Line& line : config.lines)
        for (const config::Station& station : line.stations)
            if (station.name == name) reach[line.name].set(station.id);
}

}  // namespace

Destinations destinations_of(const tcp_server::Settings& listener, const config::Config& config,
                             Unlisted unlisted) {
    const tcp_server::UnitMap units = unit_map(listener, config, unlisted);
    Destinations reach;
    for (unsigned unit = 0; unit <= 255; ++unit) {
        const auto place = units.place(static_cast<std::uint8_t>(unit));
        if (place) reach[place->line].set(place->station);
    }
    for (const images::Settings& image : config.images)
        for (const images::Entry& entry : image.entries) add_station(config, entry.station, reach);
    for (const std::string& line : units.broadcast_names(0)) reach[line].set(0);
    return reach;
}

bool leads_to(const Destinations& reach, std::string_view line, std::uint8_t station) {
    const auto found = reach.find(line);
    return found != reach.end() && found->second.test(station);
}

void Doors::open(std::shared_ptr<const config::Config> config) {
    config_ = std::move(config);
    allow_.clear();
    const auto add = [this](const auto& listener) {
        if (!listener.allow.empty()) allow_.emplace(listener.name(), listener.allow);
    };
    if (config_->http) add(*config_->http);
    doors_.clear();
    plant_.clear();
    for (const config::Line& line : config_->lines) {
        std::bitset<256>& known = plant_[line.name];
        if (line.refuse_unlisted) known.set();
        known.set(0);
        for (const config::Station& station : line.stations) known.set(station.id);
    }
    for (const tcp_server::Settings& listener : config_->modbus_tcp) {
        add(listener);
        doors_[listener.name()] = {&listener,
                                   destinations_of(listener, *config_, Unlisted::as_the_line)};
    }
    for (const serial_server::Settings& master : config_->serial_masters)
        doors_[master.name] = {&master.access,
                               destinations_of(master.access, *config_, Unlisted::refused)};
}

bool Doors::is_allowed(const std::string& listener, const std::string& address) const {
    const auto known = allow_.find(listener);
    return known == allow_.end() || lets_in(known->second, address);
}

void Doors::change(std::shared_ptr<const config::Config> config) {
    if (config_ && config_->http && config->http) {
        for (const web::Token& token : config->http->tokens) {
            const auto before =
                std::ranges::find(config_->http->tokens, token.name, &web::Token::name);
            if (before != config_->http->tokens.end() && before->hash != token.hash)
                renewed_.insert(token.name);
        }
    }
    open(std::move(config));
}

std::optional<Admission> Doors::admit(const WhoRef& who, std::string_view line,
                                      std::uint8_t station, WallTime at) const {
    if (!config_ || !who) return std::nullopt;
    switch (who->face) {
        case Face::http:
            return by_http(who, at);
        case Face::modbus_tcp:
        case Face::udp:
        case Face::serial_master:
            return by_unit(who, line, station);
        case Face::mqtt:
            return by_broker(who);
        case Face::gateway:
            break;
    }
    return std::nullopt;
}

std::optional<Admission> Doors::by_http(const WhoRef& who, WallTime at) const {
    if (!config_->http) return std::nullopt;
    const web::Settings& http = *config_->http;
    if (!is_allowed(http.name(), who->address)) return not_allowed(who);
    if (who->token.empty()) {
        const Standing now = standing_without_token(*who, http);
        if (now == who->standing) return std::nullopt;
        return with(who, now);
    }
    const auto token = std::ranges::find(http.tokens, who->token, &web::Token::name);
    if (token == http.tokens.end() || renewed_.contains(who->token))
        return out(who, "token", "the token that it was sent with is not known any more");
    if (token->has_expired(at))
        return out(who, "token", "the token that it was sent with has expired");
    if (token->standing == who->standing) return std::nullopt;
    return with(who, token->standing);
}

std::optional<Admission> Doors::by_unit(const WhoRef& who, std::string_view line,
                                        std::uint8_t station) const {
    const auto door = doors_.find(who->listener);
    if (door == doors_.end()) return std::nullopt;
    if (!is_allowed(who->listener, who->address)) return not_allowed(who);
    // What the plant has no more is its line's to say.
    if (!leads_to(door->second.reach, line, station) && leads_to(plant_, line, station))
        return out(who, "access", "its listener does not lead there any more");
    const tcp_server::Settings& listener = *door->second.listener;
    if (listener.read_only) return only_reads(who, "access", "its listener is read-only now");
    if (listener.broadcast == tcp_server::BroadcastMode::deny)
        return Admission{.who = who,
                         .may = rights({Right::read, Right::write}),
                         .rule = "access",
                         .why = "its listener takes no broadcasts now"};
    return std::nullopt;
}

std::optional<Admission> Doors::by_broker(const WhoRef& who) const {
    if (config_->mqtt && config_->mqtt->write) return std::nullopt;
    return only_reads(who, "access", "writes over MQTT are off now");
}

}  // namespace panelgate::explain
