#include "panelgate/gateway/snapshot.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string_view>
#include <utility>
#include <variant>

#include "panelgate/base/series.hpp"
#include "panelgate/gateway/images.hpp"
#include "panelgate/gateway/running_line.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/points/station_points.hpp"
#include "panelgate/tcp_server/dispatch.hpp"
#include "panelgate/web/api/render.hpp"

namespace panelgate::gateway {

using bus::LineHistory;

LineHistories::LineHistories(rt::Clock& clock, std::vector<const bus::LineBus*> lines)
    : clock_(clock), alarm_(clock.make_alarm()) {
    apply(std::move(lines));
}

void LineHistories::apply(std::vector<const bus::LineBus*> lines) {
    const Duration width = slot_width(lines.size() * LineHistory::kColumns, LineHistory::kSpan,
                                      LineHistory::kNarrowest, kBytes);
    const auto before = std::exchange(histories_, {});
    for (const bus::LineBus* line : lines) {
        const auto known =
            static_cast<std::size_t>(std::ranges::find(lines_, line) - lines_.begin());
        const bool stays = known < before.size() && before[known]->width() == width;
        histories_.push_back(stays ? before[known] : std::make_shared<LineHistory>(width));
    }
    if (lines_ == lines) return;
    lines_ = std::move(lines);
    if (running_) start();
}

void LineHistories::stop() {
    running_ = false;
    alarm_->cancel();
}

void LineHistories::start() {
    running_ = true;
    alarm_->cancel();
    if (lines_.empty()) return;
    began_ = clock_.now();
    looks_ = 0;
    look();
}

/// The samples are spread over a slot. A late one does not delay the next and is recorded for its
/// due time, so that each falls into its own slot.
void LineHistories::look() {
    const auto count = static_cast<std::int64_t>(lines_.size());
    const Duration pause = histories_.front()->width() / count;
    const auto line = static_cast<std::size_t>(looks_ % count);
    histories_[line]->record(began_ + looks_ * pause, lines_[line]->report());
    looks_ = std::max(looks_ + 1, (clock_.now() - began_) / pause);
    alarm_->arm(began_ + looks_ * pause, [this] { look(); });
}

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

points::PointSample sample_of(const SeenPoint& seen) {
    const auto& [station, point, reading] = seen;
    points::PointSample sample{station->line, station->name, point->name, point->unit, {}, {}};
    sample.value = reading.good_number();
    if (reading.age) sample.age = to_seconds(*reading.age);
    return sample;
}

/// Converts bus events to those of /api/v1/events.
struct Publisher {
    web::EventOutlet& events;
    const Plant& plant;
    const std::string& line;

    void operator()(const bus::LineEvent& event) const {
        if (!events.is_wanted()) return;
        events.publish({"line", line, {}, {}, plant.name_of(line, event.station)},
                       web::line_event(line, event.up ? "up" : "down", event.why));
    }
    void operator()(const arbiter::StationEvent& event) const {
        if (!events.is_wanted()) return;
        const std::string station = plant.name_of(line, event.station);
        events.publish({"station", line, station, {}},
                       web::station_event(line, station, label(event.kind)));
    }
    void operator()(const bus::TransactionEvent& event) const {
        if (!events.is_wanted()) return;
        const std::string station = plant.name_of(line, event.station);
        events.publish({"transaction", line, station, {}},
                       web::transaction_event(line, station, event.function, label(event.outcome),
                                              event.took));
    }
    void operator()(const bus::WriteEvent&) const {}   // published as changes of points
    void operator()(const tap::Transaction&) const {}  // likewise
    void operator()(const bus::ForeignRequest&) const {}
};

}  // namespace

web::Directory directory_of(const Plant& plant, const profile::PanelProfile& generic) {
    web::Directory directory;
    directory.generic = &generic;
    for (const Line& line : plant.lines()) {
        directory.lines.push_back(
            {line.configured->name, line.device, line.bus, !line.configured->refuse_unlisted,
             line.configured->arbiter.queue.deadline, line.configured->device.serial, nullptr,
             line.configured->access.rules});
    }
    for (const Station& station : plant.stations()) directory.stations.push_back(entry_of(station));
    return directory;
}

std::vector<SeenPoint> seen_points(const Plant& plant, TimePoint now) {
    std::vector<SeenPoint> seen;
    for (const Station& station : plant.stations()) {
        if (!station.points) continue;
        for (const points::Point& point : station.points->points())
            seen.push_back({&station, &point, station.points->read(point, now)});
    }
    return seen;
}

std::deque<points::PointSample> samples_of(const std::vector<SeenPoint>& points) {
    std::deque<points::PointSample> samples;
    for (const SeenPoint& seen : points) samples.push_back(sample_of(seen));
    return samples;
}

std::vector<points::RelaySample> relay_samples(const std::vector<points::RelayStatus>& relays) {
    std::vector<points::RelaySample> samples;
    for (const points::RelayStatus& relay : relays) {
        samples.push_back({relay.name, relay.state == points::RelayState::ok, relay.reads,
                           relay.writes, relay.repairs, relay.read_failures, relay.write_failures});
    }
    return samples;
}

void publish(web::EventOutlet& events, const Plant& plant, const std::string& line,
             const bus::BusEvent& event) {
    std::visit(Publisher{events, plant, line}, event);
}

void remember(Station& station, const std::vector<std::size_t>& wants, TimePoint now) {
    if (!station.points || !station.history) return;
    for (const std::size_t want : wants) {
        const points::Point* point = station.points->point_of(want);
        if (point != nullptr)
            station.history->record(now, *point, station.points->read(*point, now));
    }
}

void publish_points(web::EventOutlet& events, Station& station,
                    const std::vector<std::size_t>& wants, TimePoint now) {
    if (!station.points) return;
    for (const std::size_t want : wants) {
        const points::Point* point = station.points->point_of(want);
        if (point == nullptr || !events.is_wanted()) continue;  // a poll block
        const points::PointReading reading = station.points->read(*point, now);
        if (!point->report.empty() &&
            station.told[want].take(point->report, reading, now) == points::Report::none)
            continue;
        events.publish({"point", station.line, station.name, point->name},
                       web::point_event(station, *point, reading));
    }
}

std::shared_ptr<Snapshot> make_snapshot(std::shared_ptr<const config::Config> config,
                                        std::vector<std::shared_ptr<RunningLine>> lines,
                                        Images& images) {
    auto snapshot = std::make_shared<Snapshot>();
    snapshot->config = std::move(config);
    snapshot->lines = std::move(lines);
    for (std::size_t i = 0; i < snapshot->lines.size(); ++i) {
        const config::Line& line = snapshot->config->lines[i];
        RunningLine& runs = *snapshot->lines[i];
        snapshot->plant.add(line, runs.bus(), runs.simulated());
    }
    images.add_to(snapshot->plant, *snapshot->config);
    std::size_t at = 0;  // the plant's stations are in this order
    for (std::size_t i = 0; i < snapshot->lines.size(); ++i) {
        for (const config::Station& station : snapshot->config->lines[i].stations)
            snapshot->plant.stations()[at++].points = snapshot->lines[i]->points_of(station);
    }
    for (const tcp_server::Settings& settings : snapshot->config->modbus_tcp)
        snapshot->plant.add_units(tcp_server::UnitMap(settings, snapshot->plant.listener_lines()));
    return snapshot;
}

void keep_histories(Snapshot& snapshot, const Snapshot* before, LineHistories& lines) {
    std::size_t points = 0;
    for (const Station& station : snapshot.plant.stations())
        points += station.points ? station.points->points().size() : 0;
    const Duration width = points::StationHistory::width_for(points);
    using Key = std::pair<std::string_view, std::uint8_t>;
    std::map<Key, const Station*> known;
    if (before != nullptr) {
        for (const Station& station : std::as_const(before->plant).stations())
            if (station.history) known.emplace(Key(station.line, station.id), &station);
    }
    for (Station& station : snapshot.plant.stations()) {
        if (!station.points) continue;
        station.history.emplace(station.points->points(), width);
        const auto was = known.find(Key(station.line, station.id));
        if (was != known.end()) station.history->adopt(*was->second->history);
    }
    std::vector<const bus::LineBus*> buses;
    for (const auto& line : snapshot.lines) buses.push_back(&line->bus());
    lines.apply(std::move(buses));
    for (std::size_t i = 0; i < snapshot.lines.size(); ++i)
        snapshot.histories.push_back(lines.at(i));
}

}  // namespace panelgate::gateway
