#include "panelgate/tcp_server/dispatch.hpp"

#include <utility>
#include <vector>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::tcp_server {
namespace {

Refuse refuse(Fault fault, std::vector<Target> asked = {}) {
    return Refuse{modbus::to_exception(fault), std::move(asked)};
}

/// Whoever the unit stands for: all lines of a broadcast, one station, or nobody.
std::vector<Target> targets_of(std::uint8_t unit, const UnitMap& units) {
    std::vector<Target> targets;
    for (bus::BusClient* line : units.broadcast_lines(unit)) targets.push_back({line, 0});
    if (const Result<Target> target = units.route(unit); target && targets.empty())
        targets.push_back(*target);
    return targets;
}

/// Those that refuse every write; the refusal of one is everybody's.
std::vector<Target> refusing(std::vector<Target> targets) {
    std::erase_if(targets, [](const Target& target) {
        return !target.bus->refusal_of_write(target.station);
    });
    return targets;
}

Decision decide_broadcast(std::uint8_t function, Result<modbus::Request> request,
                          const Settings& settings, std::vector<Target> lines) {
    if (settings.broadcast == BroadcastMode::deny) return refuse(Fault::denied, std::move(lines));
    // All of them before any is asked.
    if (auto unwilling = refusing(lines); !unwilling.empty())
        return refuse(Fault::denied, std::move(unwilling));
    if (!modbus::is_broadcastable(function)) return refuse(Fault::denied, std::move(lines));
    if (!request) return refuse(request.error(), std::move(lines));
    Broadcast all{{}, std::move(*request)};
    for (const Target& line : lines) all.lines.push_back(line.bus);
    return all;
}

}  // namespace

Decision decide(std::uint8_t unit, ByteView pdu, const Settings& settings, const UnitMap& units) {
    if (pdu.empty()) return refuse(Fault::malformed);
    auto request = modbus::Request::make(Bytes(pdu.begin(), pdu.end()), modbus::QuantityCheck::fit);
    if (!request && request.error() == Fault::denied) return refuse(Fault::denied);
    const bool itself = settings.diagnostics_unit == unit && !units.is_alias(unit);
    const bool writes = !modbus::is_pure_read(pdu);  // also of one that is malformed
    if (itself) return Diagnose{};                   // nothing of it can be written
    if (writes && settings.read_only) return refuse(Fault::denied, targets_of(unit, units));

    const bool broadcast = !units.broadcast_lines(unit).empty();
    const Result<Target> target = units.route(unit);
    if (request && target && !broadcast) return Forward{*target, std::move(*request)};
    std::vector<Target> targets = targets_of(unit, units);
    if (targets.empty()) return refuse(Fault::not_routed);
    if (broadcast)
        return decide_broadcast(pdu[0], std::move(request), settings, std::move(targets));
    // What is a request the bus refuses itself.
    const bool denied = writes && !refusing(targets).empty();
    return refuse(denied ? Fault::denied : request.error(), std::move(targets));
}

}  // namespace panelgate::tcp_server
