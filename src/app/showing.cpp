#include "showing.hpp"

#include <cstdint>
#include <utility>
#include <variant>

#include "panelgate/points/station_history.hpp"
#include "panelgate/points/value.hpp"
#include "panelgate/web/api/event_text.hpp"
#include "simulated_line.hpp"

namespace panelgate::app {
namespace {

web::StationEntry entry_of(const Station& station) {
    web::StationEntry entry;
    static_cast<bus::StationRef&>(entry) = station;
    entry.profile = station.configured->profile;
    entry.read_only = station.configured->read_only;
    entry.unit = station.unit;
    entry.points = station.points ? &*station.points : nullptr;
    entry.history = station.history ? &*station.history : nullptr;
    entry.simulated = simulated_panel(station.simulated, station.id);
    return entry;
}

points::PointSample sample_of(const Station& station, const points::Point& point, TimePoint now) {
    const points::PointReading reading = station.points->read(point, now);
    points::PointSample sample{station.line, station.name, point.name, point.unit, {}, {}};
    if (reading.value && reading.quality == points::Quality::good)
        sample.value = points::number_of(*reading.value);
    if (reading.age) sample.age = to_seconds(*reading.age);
    return sample;
}

/// Puts what a bus tells into the words of /api/v1/events.
struct Publisher {
    web::EventHub& hub;
    const Plant& plant;
    const std::string& line;

    void operator()(const bus::LineEvent& event) const {
        if (!hub.announce("line")) return;
        hub.publish({"line", line, {}, {}},
                    web::line_event(line, event.up ? "up" : "down", event.why));
    }
    void operator()(const arbiter::StationEvent& event) const {
        if (!hub.announce("station")) return;
        const std::string station = plant.name_of(line, event.station);
        hub.publish({"station", line, station, {}},
                    web::station_event(line, station, label(event.kind)));
    }
    void operator()(const bus::TransactionEvent& event) const {
        if (!hub.announce("transaction")) return;
        const std::string station = plant.name_of(line, event.station);
        hub.publish({"transaction", line, station, {}},
                    web::transaction_event(line, station, event.function, label(event.outcome),
                                           event.took));
    }
    void operator()(const bus::WriteEvent&) const {}   // the points it touches are told
    void operator()(const tap::Transaction&) const {}  // as are these
};

}  // namespace

web::Directory directory_of(const Plant& plant, const profile::PanelProfile& generic) {
    web::Directory directory;
    directory.generic = &generic;
    for (const Line& line : plant.lines()) {
        directory.lines.push_back(
            {line.configured->name, line.device, line.bus, !line.configured->refuse_unlisted,
             line.configured->arbiter.queue.deadline, line.configured->device.serial});
    }
    for (const Station& station : plant.stations()) directory.stations.push_back(entry_of(station));
    return directory;
}

bool PointCopy::next(std::deque<points::PointSample>& samples, TimePoint now) {
    for (std::size_t left = kPiece; left > 0 && station_ < plant_->stations().size();) {
        const Station& station = plant_->stations()[station_];
        if (!station.points || point_ == station.points->points().size()) {
            ++station_;
            point_ = 0;
            continue;
        }
        samples.push_back(sample_of(station, station.points->points()[point_], now));
        ++point_;
        --left;
    }
    return station_ < plant_->stations().size();
}

std::vector<points::RelaySample> relay_samples(const std::vector<points::RelayStatus>& relays) {
    std::vector<points::RelaySample> samples;
    for (const points::RelayStatus& relay : relays) {
        samples.push_back({relay.name, relay.state == points::RelayState::ok, relay.reads,
                           relay.writes, relay.repairs, relay.read_failures, relay.write_failures});
    }
    return samples;
}

void publish(web::EventHub& hub, const Plant& plant, const std::string& line,
             const bus::BusEvent& event) {
    std::visit(Publisher{hub, plant, line}, event);
}

void remember(Station& station, const std::vector<std::size_t>& wants, TimePoint now) {
    if (!station.points || !station.history) return;
    for (const std::size_t want : wants) {
        const points::Point* point = station.points->point_of(want);
        if (point != nullptr)
            station.history->record(now, *point, station.points->read(*point, now));
    }
}

void publish_points(web::EventHub& hub, const Station& station,
                    const std::vector<std::size_t>& wants, TimePoint now) {
    if (!station.points) return;
    for (const std::size_t want : wants) {
        const points::Point* point = station.points->point_of(want);
        if (point == nullptr || !hub.announce("point")) continue;  // a poll block
        hub.publish({"point", station.line, station.name, point->name},
                    web::point_event(station, *point, station.points->read(*point, now)));
    }
}

}  // namespace panelgate::app
