#include "request_counters.hpp"

#include <utility>

#include "panelgate/base/reserved_names.hpp"
#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/function.hpp"

namespace panelgate::bus {

namespace {

std::optional<bool> is_there(Health state) {
    if (state == Health::unknown) return {};
    return state == Health::online || state == Health::heard || state == Health::suspect;
}

}  // namespace

Outcome outcome_of(const Answer& answer) {
    if (!answer.pdu) return outcome_of(answer.pdu.error());
    if (modbus::exception_of(*answer.pdu))
        return answer.transmitted ? Outcome::exception : Outcome::refused;
    if (answer.source == Source::cache) return Outcome::cached;
    return answer.shared ? Outcome::shared : Outcome::ok;
}

RequestCounters::RequestCounters(const Stations& stations) { apply(stations); }

void RequestCounters::apply(const Stations& stations) {
    std::map<std::uint8_t, StationReport> before = std::exchange(stations_, {});
    stations_[0] = std::move(before[0]);
    stations_[0].station = kOtherStations;
    for (const auto& [id, station] : stations) {
        stations_[id] = std::move(before[id]);
        stations_[id].station = station.name;
        stations_[id].configured = true;
        for (const std::uint8_t function : station.functions) stations_[id].requests[function];
        for (const auto& functions : station.translations) stations_[id].translated[functions];
    }
}

StationReport& RequestCounters::of(std::uint8_t station) {
    const auto found = stations_.find(station);
    return found == stations_.end() ? stations_[0] : found->second;
}

void RequestCounters::count(std::uint8_t station, std::uint8_t function, Outcome outcome,
                            Duration took) {
    StationReport& report = of(station);
    ++report.requests[modbus::is_known(function) ? function : kOtherFunctions][outcome];
    report.request_duration.observe(took);
}

void RequestCounters::succeeded(std::uint8_t station, double wall) {
    of(station).last_success_unix = wall;
}

OutcomeCounts RequestCounters::outcomes(std::uint8_t station) const {
    OutcomeCounts all;
    const auto found = stations_.find(station);
    if (found == stations_.end() || !found->second.configured) return all;
    for (const auto& [function, counts] : found->second.requests) {
        for (const Outcome outcome : kAllOutcomes) all[outcome] += counts[outcome];
    }
    return all;
}

std::vector<StationReport> RequestCounters::report(const arbiter::Arbiter& arbiter) const {
    return report(arbiter.station_counters(),
                  [&](std::uint8_t id) { return arbiter.health(id).state(); });
}

std::vector<StationReport> RequestCounters::report(
    const std::map<std::uint8_t, arbiter::StationCounters>& counted_there,
    const std::function<Health(std::uint8_t)>& health) const {
    std::vector<StationReport> reports;
    for (const auto& [id, counted] : stations_) {
        StationReport report = counted;
        const auto wire = counted_there.find(id);
        if (wire != counted_there.end()) report.wire = wire->second;
        report.up = is_there(health(id));
        reports.push_back(std::move(report));
    }
    return reports;
}

}  // namespace panelgate::bus
