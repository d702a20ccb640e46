#include "panelgate/bus/rights.hpp"

#include <cstdlib>

namespace panelgate::bus {

std::string_view label(Rule rule) {
    switch (rule) {
        case Rule::read_only:
        case Rule::broadcast_over_read_only:
            return "access";
        case Rule::function:
            return "function";
        case Rule::quantity:
            return "quantity";
        case Rule::range:
            return "range";
        case Rule::listening:
            return "listen";
        case Rule::standby:
            return "standby";
        case Rule::write_protected:
            return "read-only";
        case Rule::unrecorded:
            return "audit";
        case Rule::denied:
            return "denied";
    }
    std::abort();
}

std::optional<modbus::Request> translated(const Stations& stations, std::uint8_t id,
                                          const modbus::Request& request) {
    const auto listed = stations.find(id);
    if (id == 0 || listed == stations.end() || !listed->second.translate) return std::nullopt;
    return listed->second.translate(request);
}

bool has_any_length(const Stations& stations, std::uint8_t id) {
    const auto listed = stations.find(id);
    return listed != stations.end() && listed->second.any_length;
}

std::string name_of(const Stations& stations, std::uint8_t id) {
    const auto listed = stations.find(id);
    return listed == stations.end() ? std::to_string(id) : listed->second.name;
}

namespace {

modbus::ExceptionCode code_of(Rule rule) {
    switch (rule) {
        case Rule::read_only:
        case Rule::broadcast_over_read_only:
        case Rule::denied:
        case Rule::function:
            return modbus::ExceptionCode::illegal_function;
        case Rule::quantity:
            return modbus::ExceptionCode::illegal_data_value;
        case Rule::listening:
        case Rule::standby:
            return modbus::ExceptionCode::gateway_path_unavailable;
        case Rule::range:
        case Rule::write_protected:  // the manuals disagree about the code
            return modbus::ExceptionCode::illegal_data_address;
        case Rule::unrecorded:
            return modbus::ExceptionCode::server_device_busy;
    }
    std::abort();
}

Refusal refusal_by(Rule rule, std::string station, std::string why = {}) {
    return {rule, std::move(station), code_of(rule), std::move(why), {}, {}};
}

}  // namespace

Refusal denial(const access::Verdict& verdict, std::string station) {
    Refusal made = refusal_by(Rule::denied, std::move(station), std::string(verdict.rule_name()));
    if (!verdict.role.empty()) made.lacking = access::label(verdict.act);
    return made;
}

std::optional<Refusal> refusal_at_door(const Admission& now, access::Acts acts,
                                       std::string station) {
    using access::Act;
    for (const Act act : {Act::read, Act::write, Act::broadcast, Act::raw}) {
        if (!acts.has(act) || now.may.has(access::right_of(act))) continue;
        if (now.rule.empty())
            return denial({.allowed = false, .act = act, .role = now.who->standing.name()},
                          std::move(station));
        Refusal made = refusal_by(Rule::denied, std::move(station), std::string(now.rule));
        made.door = now.why;
        return made;
    }
    return std::nullopt;
}

Refusal unrecorded(std::string station) { return refusal_by(Rule::unrecorded, std::move(station)); }

Result<Bytes> answer_to(const Refusal& refusal, std::uint8_t function) {
    if (is_access(refusal.rule)) return Fault::denied;
    return modbus::encode_exception(function, refusal.code);
}

std::optional<Refusal> Rights::judge(std::uint8_t station, const modbus::Request& request) const {
    if (station == 0) return judge_broadcast();
    if (!request.is_read()) {
        if (auto refusal = judge_write(station)) return refusal;
    }
    const auto listed = stations_.find(station);
    if (listed == stations_.end() || !listed->second.guard) return std::nullopt;
    auto objection = listed->second.guard(request);
    if (!objection) return std::nullopt;
    return refusal_by(objection->rule, listed->second.name, std::move(objection->why));
}

std::optional<Refusal> Rights::judge(const WhoRef& who,
                                     const access::LineRules::Question& question) const {
    if (!rules_) return std::nullopt;
    const access::Verdict verdict = rules_->judge(who, question);
    if (verdict.allowed) return std::nullopt;
    return denial(verdict,
                  question.station == 0 ? std::string() : name_of(stations_, question.station));
}

std::optional<Refusal> Rights::judge_write(std::uint8_t station) const {
    if (station == 0) return judge_broadcast();
    const auto listed = stations_.find(station);
    if (listed == stations_.end() || listed->second.access != Access::read_only)
        return std::nullopt;
    return refusal_by(Rule::read_only, listed->second.name);
}

/// A broadcast reaches every station: one read-only station forbids it.
std::optional<Refusal> Rights::judge_broadcast() const {
    for (const auto& [id, station] : stations_) {
        if (station.access != Access::read_only) continue;
        return refusal_by(Rule::broadcast_over_read_only, station.name);
    }
    return std::nullopt;
}

}  // namespace panelgate::bus
