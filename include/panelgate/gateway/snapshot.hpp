#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/bus/line_history.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/gateway/plant.hpp"
#include "panelgate/gateway/running_line.hpp"
#include "panelgate/points/counters.hpp"
#include "panelgate/points/relays.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/web/api/directory.hpp"
#include "panelgate/web/http/event_hub.hpp"

namespace panelgate::gateway {

/// Samples each line once per slot of its history, one line at a time. One thread.
class LineHistories {
  public:
    static constexpr std::size_t kBytes = 4 * 1024 * 1024;  ///< for all lines together

    /// The clock and the lines outlive it.
    LineHistories(rt::Clock& clock, std::vector<const bus::LineBus*> lines);

    /// Samples these lines from now on. The history of lines that stay is kept unless the slot
    /// width changes.
    void apply(std::vector<const bus::LineBus*> lines);

    void start();
    void stop();
    /// The history of a line, by its index. May outlive this.
    const std::shared_ptr<bus::LineHistory>& at(std::size_t line) const { return histories_[line]; }

  private:
    void look();

    rt::Clock& clock_;
    std::vector<const bus::LineBus*> lines_;
    std::vector<std::shared_ptr<bus::LineHistory>> histories_;
    std::unique_ptr<rt::Alarm> alarm_;
    TimePoint began_{};
    std::int64_t looks_ = 0;
    bool running_ = false;
};

// Views of the plant for REST, /metrics and events. Nothing here touches a bus (P10).

/// REST's view. `generic` is the profile of unlisted stations; it and the plant outlive the view.
web::Directory directory_of(const Plant& plant, const profile::PanelProfile& generic);

/// A point with what was read of it.
struct SeenPoint {
    const Station* station;
    const points::Point* point;
    points::PointReading reading;
};
/// All points of the plant, without their texts. The plant outlives the list.
std::vector<SeenPoint> seen_points(const Plant& plant, TimePoint now);
/// The same for metrics, in any thread.
std::deque<points::PointSample> samples_of(const std::vector<SeenPoint>& points);
std::vector<points::RelaySample> relay_samples(const std::vector<points::RelayStatus>& relays);

/// Publishes what has happened on a line, if any client listens.
void publish(web::EventOutlet& events, const Plant& plant, const std::string& line,
             const bus::BusEvent& event);
/// The same for the points among these wants of the station's polls.
void publish_points(web::EventOutlet& events, Station& station,
                    const std::vector<std::size_t>& wants, TimePoint now);

/// Records the points among these wants in the station's history, if it has one.
void remember(Station& station, const std::vector<std::size_t>& wants, TimePoint now);

/// One configuration with plant and running lines. A reload makes a new snapshot; users of a
/// snapshot keep the snapshot until their work is done. Does not move.
struct Snapshot {
    std::shared_ptr<const config::Config> config;
    std::vector<std::shared_ptr<RunningLine>> lines;  ///< in the order of config->lines
    Plant plant;
    /// In the same order; empty if no history is kept.
    std::vector<std::shared_ptr<bus::LineHistory>> histories;
    web::Directory directory;  ///< REST's view

    Snapshot() = default;
    Snapshot(const Snapshot&) = delete;
    Snapshot& operator=(const Snapshot&) = delete;
};

class Images;
/// Makes the snapshot of running lines with a configuration, in the order of the configuration.
std::shared_ptr<Snapshot> make_snapshot(std::shared_ptr<const config::Config> config,
                                        std::vector<std::shared_ptr<RunningLine>> lines,
                                        Images& images);
/// Starts the histories of its points and continues those of unchanged stations in `before` (may be
/// null); `lines` does so for its lines.
void keep_histories(Snapshot& snapshot, const Snapshot* before, LineHistories& lines);

}  // namespace panelgate::gateway
