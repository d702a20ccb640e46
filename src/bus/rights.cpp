#include "panelgate/bus/rights.hpp"

namespace panelgate::bus {

Result<Bytes> answer_to(const Refusal& refusal, std::uint8_t function) {
    if (refusal.rule == Refusal::Rule::guard)
        return modbus::encode_exception(function, refusal.code);
    return Fault::denied;
}

std::optional<Refusal> Rights::judge(std::uint8_t station, const modbus::Request& request) const {
    if (station == 0) return judge_broadcast();
    if (!request.is_read()) {
        if (auto refusal = judge_write(station)) return refusal;
    }
    const auto listed = stations_.find(station);
    if (listed == stations_.end() || !listed->second.guard) return std::nullopt;
    const auto code = listed->second.guard(request);
    if (!code) return std::nullopt;
    return Refusal{Refusal::Rule::guard, listed->second.name,
                   static_cast<modbus::ExceptionCode>(*code)};
}

std::optional<Refusal> Rights::judge_write(std::uint8_t station) const {
    if (station == 0) return judge_broadcast();
    const auto listed = stations_.find(station);
    if (listed == stations_.end() || listed->second.access != Access::read_only)
        return std::nullopt;
    return Refusal{Refusal::Rule::read_only, listed->second.name,
                   modbus::ExceptionCode::illegal_function};
}

/// It reaches every station: one that must not be written forbids it.
std::optional<Refusal> Rights::judge_broadcast() const {
    for (const auto& [id, station] : stations_) {
        if (station.access != Access::read_only) continue;
        return Refusal{Refusal::Rule::broadcast_over_read_only, station.name,
                       modbus::ExceptionCode::illegal_function};
    }
    return std::nullopt;
}

}  // namespace panelgate::bus
