#include "panelgate/tcp_server/dispatch.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/tls/peer.hpp"

namespace panelgate::tcp_server {

Caller::Caller(std::string name, WhoRef who) : name_(std::move(name)), who_(std::move(who)) {}

void Caller::certify(std::string subject, std::optional<std::string> role,
                     std::span<const OwnRole> own_roles) {
    Who who = *who_;
    who.certificate = std::move(subject);
    by_certificate_ = role.has_value();
    if (role) {
        who.standing = standing_named(*role, own_roles);
        who.certificate_role = std::move(*role);
    }
    who_ = make_who(std::move(who));
}

void Caller::transact(bus::RequestPort* bus, std::uint8_t station, modbus::Request request,
                      bus::AnswerHandler handler) {
    use(bus);
    bus->transact({.station = station,
                   .request = std::move(request),
                   .client = client_,
                   .who = who_,
                   .verbatim = true},
                  std::move(handler));
}

void Caller::count_refused(bus::RequestPort* bus, std::uint8_t station, ByteView pdu) {
    use(bus);
    bus->count_refused(station, pdu, who_);
}

/// Names the client on the bus before its first request.
void Caller::use(bus::RequestPort* bus) {
    if (used_.insert(bus).second) bus->name_client(client_, who_->name);
}

void Caller::withdraw() {
    // A cancelled answer may close the connection.
    const std::set<bus::RequestPort*> buses = std::exchange(used_, {});
    for (bus::RequestPort* bus : buses) bus->cancel(client_);
}

namespace {

Refuse refuse(Fault fault, std::vector<Target> asked = {}) {
    return Refuse{modbus::to_exception(fault), std::move(asked)};
}

/// Returns the unit's targets: all lines of a broadcast, one station, or none.
std::vector<Target> targets_of(std::uint8_t unit, const UnitMap& units) {
    std::vector<Target> targets;
    for (bus::BusClient* line : units.broadcast_lines(unit)) targets.push_back({line, 0});
    if (const Result<Target> target = units.route(unit); target && targets.empty())
        targets.push_back(*target);
    return targets;
}

/// Refuses with 01, or with the code of the rule if it is only that nothing can be recorded now, or
/// that another box drives the lines.
Refuse deny(std::vector<Target> unwilling, const std::vector<bus::Refusal>& refusals) {
    const bool passes = std::ranges::all_of(refusals, [](const bus::Refusal& refusal) {
        return refusal.rule == bus::Rule::unrecorded || refusal.rule == bus::Rule::standby;
    });
    if (!passes) return refuse(Fault::denied, std::move(unwilling));
    return Refuse{refusals.front().code, std::move(unwilling)};
}

/// Refuses if `refusal_of` one of the targets is there: one refusal denies the whole broadcast.
template <class RefusalOf>
std::optional<Refuse> refused_by(std::vector<Target> targets, const RefusalOf& refusal_of) {
    std::vector<bus::Refusal> refusals;
    std::erase_if(targets, [&](const Target& target) {
        auto refusal = refusal_of(target);
        if (refusal) refusals.push_back(std::move(*refusal));
        return !refusal;
    });
    if (targets.empty()) return std::nullopt;
    return deny(std::move(targets), refusals);
}

/// Refuses if one of the targets refuses every write.
std::optional<Refuse> refused_write(std::vector<Target> targets) {
    return refused_by(std::move(targets), [](const Target& target) {
        return target.bus->write_refusal(target.station);
    });
}

/// Refuses if one of the lines would refuse this broadcast.
std::optional<Refuse> refused_broadcast(std::vector<Target> lines, const modbus::Request& request,
                                        const WhoRef& who) {
    const bus::Request broadcast{.station = 0, .request = request, .who = who};
    return refused_by(std::move(lines),
                      [&](const Target& line) { return line.bus->refusal_of(broadcast); });
}

Decision decide_broadcast(std::uint8_t function, Result<modbus::Request> request,
                          const Settings& settings, std::vector<Target> lines, const WhoRef& who) {
    if (settings.broadcast == BroadcastMode::deny) return refuse(Fault::denied, std::move(lines));
    // Check all lines before sending to any.
    if (auto refused = refused_write(lines)) return std::move(*refused);
    if (!modbus::is_broadcastable(function)) return refuse(Fault::denied, std::move(lines));
    if (!request) return refuse(request.error(), std::move(lines));
    if (auto refused = refused_broadcast(lines, *request, who)) return std::move(*refused);
    Broadcast all{{}, std::move(*request)};
    for (const Target& line : lines) all.lines.push_back(line.bus);
    return all;
}

}  // namespace

Decision decide(std::uint8_t unit, ByteView pdu, const Settings& settings, const UnitMap& units,
                bool reads_only, const WhoRef& who) {
    if (pdu.empty()) return refuse(Fault::malformed);
    auto request = modbus::Request::make(Bytes(pdu.begin(), pdu.end()), modbus::QuantityCheck::fit);
    if (!request && request.error() == Fault::denied) return refuse(Fault::denied);
    const bool itself = settings.diagnostics_unit == unit && !units.is_alias(unit);
    const bool writes = !modbus::is_pure_read(pdu);  // also if malformed
    if (itself) return Diagnose{};                   // nothing in it is writable
    if (writes && (settings.read_only || reads_only))
        return refuse(Fault::denied, targets_of(unit, units));

    const bool broadcast = !units.broadcast_lines(unit).empty();
    const Result<Target> target = units.route(unit);
    if (request && target && !broadcast) return Forward{*target, std::move(*request)};
    std::vector<Target> targets = targets_of(unit, units);
    // Nothing has the address 0, so a read of it has no path: mostly no unit id is set.
    if (targets.empty() || (broadcast && !writes))
        return refuse(Fault::not_routed, std::move(targets));
    if (broadcast)
        return decide_broadcast(pdu[0], std::move(request), settings, std::move(targets), who);
    // A valid request is refused by the bus itself.
    if (auto refused = writes ? refused_write(targets) : std::nullopt) return std::move(*refused);
    return refuse(request.error(), std::move(targets));
}

}  // namespace panelgate::tcp_server
