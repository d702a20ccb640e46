#include "health_events.hpp"

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

}  // namespace panelgate::bus
