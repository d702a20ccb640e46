#include "dispatch.hpp"

#include <optional>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::tcp_server {
namespace {

using modbus::ExceptionCode;

Refuse refuse(Fault fault) { return Refuse{modbus::to_exception(fault)}; }
Refuse refuse(const bus::Refusal& refusal) { return Refuse{refusal.code}; }

Decision decide_broadcast(std::uint8_t function, Result<modbus::Request> request,
                          const Settings& settings, std::vector<bus::BusClient*> lines) {
    if (settings.broadcast == BroadcastMode::deny) return refuse(Fault::denied);
    for (const bus::BusClient* line : lines) {  // all of them before any is asked
        if (const auto refusal = line->refusal_of_write(0)) return refuse(*refusal);
    }
    if (!modbus::is_broadcastable(function)) return refuse(Fault::denied);
    if (!request) return refuse(request.error());
    return Broadcast{std::move(lines), std::move(*request)};
}

}  // namespace

Decision decide(std::uint8_t unit, ByteView pdu, const Settings& settings, const UnitMap& units) {
    if (pdu.empty()) return refuse(Fault::malformed);
    auto request = modbus::Request::make(Bytes(pdu.begin(), pdu.end()), modbus::QuantityCheck::fit);
    if (!request && request.error() == Fault::denied) return refuse(Fault::denied);
    const bool writes = !modbus::is_pure_read(pdu);  // also of one that is malformed
    if (writes && settings.read_only) return refuse(Fault::denied);
    if (settings.diagnostics_unit == unit && !units.is_alias(unit)) return Diagnose{};

    std::vector<bus::BusClient*> lines = units.broadcast_lines(unit);
    if (!lines.empty())
        return decide_broadcast(pdu[0], std::move(request), settings, std::move(lines));
    const Result<Target> target = units.route(unit);
    if (!target) return refuse(target.error());
    if (!request) {
        // What is a request the bus refuses itself, which is counted and told.
        const auto refusal = writes ? target->bus->refusal_of_write(target->station) : std::nullopt;
        return refusal ? refuse(*refusal) : refuse(request.error());
    }
    return Forward{*target, std::move(*request)};
}

}  // namespace panelgate::tcp_server
