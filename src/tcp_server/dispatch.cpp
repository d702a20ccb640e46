#include "dispatch.hpp"

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::tcp_server {
namespace {

using modbus::ExceptionCode;

Refuse refuse(Fault fault) { return Refuse{modbus::to_exception(fault)}; }
Refuse refuse(const bus::Refusal& refusal) { return Refuse{refusal.code}; }

Decision decide_broadcast(ByteView pdu, const Settings& settings,
                          std::vector<bus::BusClient*> lines) {
    if (settings.broadcast == BroadcastMode::deny) return refuse(Fault::denied);
    for (const bus::BusClient* line : lines) {  // all of them before any is asked
        if (const auto refusal = line->refusal_of_write(0)) return refuse(*refusal);
    }
    if (!modbus::is_broadcastable(pdu[0])) return refuse(Fault::denied);
    if (const auto checked = modbus::check_request(pdu); !checked) return refuse(checked.error());
    return Broadcast{std::move(lines)};
}

}  // namespace

Decision decide(std::uint8_t unit, ByteView pdu, const Settings& settings, const UnitMap& units) {
    if (pdu.empty()) return refuse(Fault::malformed);
    if (pdu[0] == 0 || pdu[0] >= modbus::kExceptionBit) return refuse(Fault::denied);
    const bool writes = !modbus::is_pure_read(pdu);
    if (writes && settings.read_only) return refuse(Fault::denied);
    if (settings.diagnostics_unit == unit && !units.is_alias(unit)) return Diagnose{};

    std::vector<bus::BusClient*> lines = units.broadcast_lines(unit);
    if (!lines.empty()) return decide_broadcast(pdu, settings, std::move(lines));
    const Result<Target> target = units.route(unit);
    if (!target) return refuse(target.error());
    if (writes) {
        if (const auto refusal = target->bus->refusal_of_write(target->station))
            return refuse(*refusal);
    }
    if (const auto checked = modbus::check_request(pdu); !checked) return refuse(checked.error());
    return Forward{*target};
}

}  // namespace panelgate::tcp_server
