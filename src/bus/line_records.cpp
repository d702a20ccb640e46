#include "line_records.hpp"

#include <cstddef>
#include <cstdlib>

#include "panelgate/arbiter/actions.hpp"

namespace panelgate::bus {
namespace {

arbiter::StationEvent::Kind event_kind_of(Health health) {
    using Kind = arbiter::StationEvent::Kind;
    switch (health) {
        case Health::unknown:
            return Kind::unknown;
        case Health::online:
            return Kind::online;
        case Health::suspect:
            return Kind::suspect;
        case Health::heard:
            return Kind::heard;
        case Health::offline:
            return Kind::offline;
    }
    std::abort();
}

}  // namespace

void HealthEvents::tell(std::uint8_t station, Health health) {
    if (std::exchange(last_[station], health) == health) return;
    observe(settings_, arbiter::StationEvent{event_kind_of(health), station, {}});
}

void HealthEvents::on_change(const Stations& next) {
    for (const auto& [id, station] : settings_.stations) {
        const auto is = next.find(id);
        if (is == next.end() || is->second.name != station.name) tell(id, Health::unknown);
    }
}

void HealthEvents::on_line_down() {
    for (std::size_t id = 0; id < last_.size(); ++id)
        tell(static_cast<std::uint8_t>(id), Health::unknown);
}

void LineRecords::leave() {
    why_down = "it is closed";
    if (!std::exchange(up, false)) return;
    observe(settings, LineEvent{false, why_down});
    health_events.on_line_down();
}

LineStatus LineRecords::status(const LineCounts& counts) {
    LineStatus status;
    status.name = settings.name;
    status.device = settings.device;
    status.up = up;
    status.state = up ? "up" : "down: " + why_down;
    status.load_percent = load.percent(clock.now());
    if (up) doctor.look_on_demand(clock.now(), counts);
    status.findings = doctor.findings();
    return status;
}

LineReport LineRecords::report() const {
    LineReport report;
    report.line = settings.name;
    report.findings = doctor.report();
    report.up = up;
    report.device = line->counters();
    report.denials = denials_by_rule(settings, denials);
    return report;
}

void RecordedBus::count_denied(std::string_view rule) { ++records().denials[std::string(rule)]; }

void RecordedBus::name_client(ClientId client, std::string name) {
    records().names.set(client, std::move(name));
}

TracePart RecordedBus::trace(std::size_t last) const { return records().book.store().part(last); }

TracePart RecordedBus::trace_since(std::uint64_t sequence, std::size_t most) const {
    return records().book.store().part_since(sequence, most);
}

std::vector<IncidentHead> RecordedBus::incidents() const {
    return records().book.incidents().heads();
}

std::optional<Incident> RecordedBus::incident(std::uint64_t id) {
    return records().book.incidents().fetch(id);
}

bool RecordedBus::tells(const WhoRef& who, std::uint8_t station) const {
    return may_tell(records().settings, who, station);
}

}  // namespace panelgate::bus
