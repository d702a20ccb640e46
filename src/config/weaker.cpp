#include "panelgate/config/weaker.hpp"

#include <algorithm>
#include <compare>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>

#include "panelgate/base/decimal.hpp"
#include "panelgate/config/endpoint.hpp"

namespace panelgate::config {
namespace {

using Lines = std::vector<std::string>;

/// Lists what a listener newly allows. An empty list allows all.
void compare_allow(Lines& all, const std::string& endpoint, const std::vector<Network>& running,
                   const std::vector<Network>& next) {
    if (running.empty()) return;
    if (next.empty()) all.push_back(endpoint + ": allow lets all addresses in");
    for (const Network& network : next) {
        const auto was_allowed = [&](const Network& one) { return covers(one, network); };
        if (std::ranges::none_of(running, was_allowed))
            all.push_back(endpoint + ": allow lets " + network_text(network) + " in");
    }
}

/// Lists what is not in the running list.
void compare_names(Lines& all, const std::string& what, const std::vector<std::string>& running,
                   const std::vector<std::string>& next) {
    for (const std::string& name : next)
        if (std::ranges::find(running, name) == running.end()) all.push_back(what + ' ' + name);
}

void compare_access(Lines& all, const std::string& what, bool was_read_only, bool is_read_only) {
    if (was_read_only && !is_read_only) all.push_back(what + ": access read_only -> read_write");
}

/// True if clients that reach `endpoint` could reach `before`.
template <class ListenAddress>
bool was_open(const ListenAddress& before, const ListenAddress& endpoint) {
    if (before.port != endpoint.port) return false;
    if (before.address == endpoint.address) return before.ipv6_only || !endpoint.ipv6_only;
    const bool was_dual_stack = is_ipv6(before.address) && !before.ipv6_only;
    return is_any_address(before.address) &&
           (was_dual_stack || is_ipv6(before.address) == is_ipv6(endpoint.address));
}

/// Compares what a Modbus client may do.
void compare_rights(Lines& all, const std::string& endpoint, const tcp_server::Settings& running,
                    const tcp_server::Settings& next) {
    using tcp_server::BroadcastMode;
    compare_access(all, endpoint, running.read_only, next.read_only);
    if (running.broadcast == BroadcastMode::deny && next.broadcast != BroadcastMode::deny)
        all.push_back(endpoint + ": broadcast deny -> " +
                      (next.broadcast == BroadcastMode::reply ? "reply" : "silent"));
    compare_names(all, endpoint + ": reaches line", running.lines, next.lines);
    const bool was_one = running.units.contains(0) && !next.units.contains(0);
    if (was_one && next.broadcast != BroadcastMode::deny)
        all.push_back(endpoint + ": unit 0 is a broadcast to all stations");
    for (const auto& [unit, target] : next.units) {
        const auto was = running.units.find(unit);
        if (was == running.units.end() || was->second != target)
            all.push_back(endpoint + ": unit " + std::to_string(unit) + " is station " +
                          std::to_string(target.station) + " of " + target.line);
    }
}

/// Without TLS, or with certificates that fewer clients need.
void compare_tls(Lines& all, const std::string& endpoint,
                 const std::optional<tls::Settings>& running,
                 const std::optional<tls::Settings>& next) {
    if (!running) return;
    if (!next) {
        all.push_back(endpoint + ": tls is removed");
        return;
    }
    if (next->client < running->client)
        all.push_back(endpoint + ": tls asks fewer clients for a certificate");
    if (running->role_from_certificate && !next->role_from_certificate)
        all.push_back(endpoint + ": roles of certificates no longer count");
    if (!running->crl.empty() && next->crl.empty())
        all.push_back(endpoint + ": revoked certificates are accepted");
    else if (running->crl != next->crl)
        all.push_back(endpoint + ": another list of revoked certificates counts");
    if (next->lowest < running->lowest)
        all.push_back(endpoint + ": tls min_version TLSv1.3 -> TLSv1.2");
    if (next->material.ca != running->material.ca || next->ca != running->ca)
        all.push_back(endpoint + ": certificates of another CA are accepted");
}

void compare_listeners(Lines& all, const Config& running, const Config& next) {
    for (const tcp_server::Settings& listener : next.modbus_tcp) {
        const std::string endpoint = "modbus_tcp " + listener.name();
        const auto was = std::ranges::find_if(
            running.modbus_tcp, [&](const auto& before) { return was_open(before, listener); });
        if (was == running.modbus_tcp.end()) {
            all.push_back(endpoint + ": is opened");
            continue;
        }
        if (!was->udp && listener.udp) all.push_back(endpoint + ": udp false -> true");
        if (!was->diagnostics_unit && listener.diagnostics_unit)
            all.push_back(endpoint + ": diagnostics_unit null -> " +
                          std::to_string(*listener.diagnostics_unit));
        compare_tls(all, endpoint, was->tls, listener.tls);
        compare_allow(all, endpoint, was->allow, listener.allow);
        compare_rights(all, endpoint, *was, listener);
    }
}

void compare_serial_masters(Lines& all, const Config& running, const Config& next) {
    for (const serial_server::Settings& master : next.serial_masters) {
        const std::string endpoint = "serial master " + master.name;
        const auto was =
            std::ranges::find(running.serial_masters, master.name, &serial_server::Settings::name);
        if (was == running.serial_masters.end()) {
            all.push_back(endpoint + ": is opened");
        } else {
            compare_rights(all, endpoint, was->access, master.access);
        }
    }
}

const Line* find_line(const Config& config, const Line& like) {
    auto found = std::ranges::find(config.lines, like.name, &Line::name);
    if (found == config.lines.end() && like.kind != Line::Kind::simulated)
        found = std::ranges::find(config.lines, like.device.device,
                                  [](const Line& line) { return line.device.device; });
    return found == config.lines.end() ? nullptr : &*found;
}

/// Lists a limit that has moved outwards; one that is missing is the widest.
void compare_limit(Lines& all, const std::string& what, const std::optional<Decimal>& running,
                   const std::optional<Decimal>& next, std::strong_ordering outwards) {
    if (!running || (next && (*next <=> *running) != outwards)) return;
    all.push_back(what + ' ' + running->text() + " -> " + (next ? next->text() : "none"));
}

/// True if a value written to them reaches the same items as the same numbers.
bool is_written_alike(const points::Point& one, const points::Point& other) {
    const auto written = [](const points::Point& point) {
        return std::tie(point.table, point.address, point.bit, point.type, point.word_order,
                        point.length, point.scale, point.offset);
    };
    return written(one) == written(other);
}

/// Compares what may be written to points.
void compare_points(Lines& all, const Station& running, const Station& next) {
    for (const points::Point& point : next.points) {
        if (!point.writable) continue;
        const std::string what = "point " + running.name + '/' + point.name;
        const auto was = std::ranges::find(running.points, point.name, &points::Point::name);
        if (was == running.points.end() || !was->writable) {
            all.push_back(what + ": is writable");
            continue;
        }
        if (!is_written_alike(*was, point))
            all.push_back(what + ": a value is written to another place, or as another number");
        compare_limit(all, what + ": max", was->max, point.max, std::strong_ordering::greater);
        compare_limit(all, what + ": min", was->min, point.min, std::strong_ordering::less);
    }
}

const arbiter::StationSettings& settings_at(const Line& line, std::uint8_t station) {
    const auto found =
        std::ranges::find(line.arbiter.stations, station, &arbiter::StationSettings::id);
    return found == line.arbiter.stations.end() ? line.arbiter.unlisted : *found;
}

/// Compares how often a write that the station has not answered is repeated.
void compare_repeated_writes(Lines& all, const Line& running, const Line& next) {
    for (const Station& station : next.stations) {
        const arbiter::StationSettings& was = settings_at(running, station.id);
        const arbiter::StationSettings& is = settings_at(next, station.id);
        const int repeated_before = was.retry_writes ? was.retries : 0;
        if (!is.retry_writes || is.retries <= repeated_before) continue;
        std::string change = "retry_writes false -> true";
        if (was.retry_writes)
            change = "retries " + std::to_string(was.retries) + " -> " +
                     std::to_string(is.retries) + ", of writes too";
        all.push_back("station " + station.name + ": " + change);
    }
}

void compare_stations(Lines& all, const Line& running, const Line& next) {
    for (const Station& was : running.stations) {
        const std::string what = "station " + was.name;
        const auto is = std::ranges::find(next.stations, was.id, &Station::id);
        if (is == next.stations.end()) {
            const bool passes = !next.refuse_unlisted && !next.listens;
            if (passes && (was.read_only || was.guard))
                all.push_back(what + ": is not listed, so nothing is refused for it");
            continue;
        }
        compare_access(all, what, was.read_only, is->read_only);
        if (was.guard && !is->guard) all.push_back(what + ": guard true -> false");
        if (was.guard && is->guard && was.profile->name != is->profile->name)
            all.push_back(what + ": guard by profile " + was.profile->name + " -> " +
                          is->profile->name);
        compare_points(all, was, *is);
    }
}

void compare_lines(Lines& all, const Config& running, const Config& next) {
    for (const Line& line : next.lines) {
        const Line* was = find_line(running, line);
        if (was == nullptr) continue;
        if (was->listens && !line.listens)
            all.push_back("line " + line.name + ": mode listen -> ask");
        if (was->refuse_unlisted && !line.refuse_unlisted)
            all.push_back("line " + line.name + ": unlisted_stations refuse -> pass");
        compare_stations(all, *was, line);
        compare_repeated_writes(all, *was, line);
    }
}

bool is_same_place(const points::RelayEnd& one, const points::RelayEnd& other) {
    return one.station == other.station && one.table == other.table && one.address == other.address;
}

/// Compares what relays write, and from where.
void compare_relays(Lines& all, const Config& running, const Config& next) {
    for (const points::Relay& relay : next.relays) {
        const auto was = std::ranges::find_if(running.relays, [&](const points::Relay& before) {
            return is_same_place(before.from, relay.from) && is_same_place(before.to, relay.to);
        });
        if (was == running.relays.end()) {
            all.push_back("relay " + relay.name() + ": is added");
        } else if (was->count < relay.count) {
            all.push_back("relay " + relay.name() + ": count " + std::to_string(was->count) +
                          " -> " + std::to_string(relay.count));
        }
    }
}

bool lasts_longer(const web::Token& token, const web::Token& than) {
    return than.expires && (!token.expires || *token.expires > *than.expires);
}

/// "role viewer -> operator", or what the role of this name has become.
std::string change_of(const Standing& was, const Standing& now) {
    if (was.name() == now.name()) return std::string(now.name()) + " has more rights";
    return std::string(was.name()) + " -> " + std::string(now.name());
}

void compare_tokens(Lines& all, const web::Settings& running, const web::Settings& next) {
    for (const web::Token& token : next.tokens) {
        const auto was = std::ranges::find(running.tokens, token.hash, &web::Token::hash);
        if (was == running.tokens.end()) {
            all.push_back("http: token " + token.name + " is valid");
        } else if (token.standing.exceeds(was->standing)) {
            all.push_back("http: token " + token.name + ": role " +
                          change_of(was->standing, token.standing));
        } else if (lasts_longer(token, *was)) {
            all.push_back("http: token " + token.name + ": expires later");
        }
    }
}

void compare_hosts(Lines& all, const web::Settings& running, const web::Settings& next) {
    if (running.hosts.empty() && next.hosts.empty()) return;
    if (next.hosts.empty()) all.push_back("http: hosts are all names of this machine");
    compare_names(all, "http: hosts has", running.hosts, next.hosts);
}

void compare_http(Lines& all, const Config& running, const Config& next) {
    if (!next.http) return;
    const std::string endpoint = "http " + next.http->name();
    if (!running.http) {
        all.push_back(endpoint + ": is opened");
        return;
    }
    if (!was_open(*running.http, *next.http)) all.push_back(endpoint + ": is opened");
    compare_tls(all, endpoint, running.http->tls, next.http->tls);
    compare_allow(all, endpoint, running.http->allow, next.http->allow);
    compare_hosts(all, *running.http, *next.http);
    compare_names(all, "http: cors has", running.http->cors, next.http->cors);
    const Standing& was = running.http->anonymous;
    const Standing& anonymous = next.http->anonymous;
    if (anonymous.exceeds(was)) all.push_back("http: anonymous " + change_of(was, anonymous));
    compare_tokens(all, *running.http, *next.http);
}

void compare_mqtt(Lines& all, const Config& running, const Config& next) {
    if (!next.mqtt || !next.mqtt->write) return;
    if (!running.mqtt || !running.mqtt->write) all.emplace_back("mqtt: write false -> true");
}

void compare_audit(Lines& all, const Config& running, const Config& next) {
    if (!running.audit) return;
    if (!next.audit) {
        all.emplace_back("audit: is switched off");
        return;
    }
    if (next.audit->file != running.audit->file)
        all.push_back("audit: file " + running.audit->file + " -> " + next.audit->file);
    if (next.audit->on_failure < running.audit->on_failure)
        all.emplace_back("audit: on_failure refuse_writes -> continue");
    if (next.audit->keep * next.audit->rotate < running.audit->keep * running.audit->rotate)
        all.emplace_back("audit: keeps less");
}

/// The same for its rule, wherever it stands in its file.
bool is_same(access::Rule one, access::Rule other) {
    one.line = other.line = one.column = other.column = 0;
    return one == other;
}

/// Rules cannot be compared by what they let through: whatever allows more, denies less or is asked
/// in another order counts.
void compare_rules(Lines& all, const access::Settings& running, const access::Settings& next) {
    if (!running.allow_by_default && next.allow_by_default)
        all.emplace_back("access: default deny -> allow");
    const auto find = [](const access::Settings& in, const std::string& name) {
        return std::ranges::find(in.rules, name, &access::Rule::name);
    };
    for (const OwnRole& role : next.roles) {
        const auto was = std::ranges::find(running.roles, role.name, &OwnRole::name);
        const Standing before{Role::none, was == running.roles.end() ? OwnRole{} : *was};
        if (Standing(Role::none, role).exceeds(before))
            all.push_back("access: role " + role.name + " has more rights");
    }
    std::vector<std::string> kept;
    for (const access::Rule& rule : running.rules) {
        const auto now = find(next, rule.name);
        if (now != next.rules.end()) kept.push_back(rule.name);
        if (now == next.rules.end() && !rule.allow)
            all.push_back("access: rule " + rule.name + " denies no more");
        if (now != next.rules.end() && !is_same(rule, *now))
            all.push_back("access: rule " + rule.name + " is another");
    }
    std::vector<std::string> order;
    for (const access::Rule& rule : next.rules) {
        const bool known = find(running, rule.name) != running.rules.end();
        if (known) order.push_back(rule.name);
        if (!known && rule.allow) all.push_back("access: rule " + rule.name + " allows");
    }
    if (order != kept) all.emplace_back("access: the rules have another order");
}

}  // namespace

std::vector<std::string> weaker(const Config& running, const Config& next) {
    Lines all;
    compare_lines(all, running, next);
    compare_relays(all, running, next);
    compare_listeners(all, running, next);
    compare_serial_masters(all, running, next);
    compare_http(all, running, next);
    compare_mqtt(all, running, next);
    compare_audit(all, running, next);
    compare_rules(all, running.access, next.access);
    return all;
}

}  // namespace panelgate::config
