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
#include "panelgate/points/counters.hpp"
#include "panelgate/points/relays.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/web/api/directory.hpp"
#include "panelgate/web/http/event_hub.hpp"
#include "plant.hpp"
#include "running_line.hpp"

namespace panelgate::app {

/// Looks at each line once a slot of its history, at one line at a time. One thread.
class LineHistories {
  public:
    static constexpr std::size_t kBytes = 4 * 1024 * 1024;  ///< of all lines

    /// The clock and the lines outlive it.
    LineHistories(rt::Clock& clock, std::vector<const bus::LineBus*> lines);

    /// From now on these. The past of those that are among them stays, unless slots have another
    /// width.
    void apply(std::vector<const bus::LineBus*> lines);

    void start();
    void stop();
    /// By the order of the lines. May outlive this.
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

// What others are shown of the plant. Nothing here touches a bus (P10).

/// REST's view. `generic` is the profile of stations that the configuration does not list; it and
/// the plant outlive the view.
web::Directory directory_of(const Plant& plant, const profile::PanelProfile& generic);

/// The points of the plant at a scrape, some at a time. The plant outlives it.
class PointCopy {
  public:
    static constexpr std::size_t kPiece = 250;  ///< points: well below a millisecond

    explicit PointCopy(const Plant& plant) : plant_(&plant) {}
    /// Adds the next ones as they are now; false: all have been.
    bool next(std::deque<points::PointSample>& samples, TimePoint now);

  private:
    const Plant* plant_;
    std::size_t station_ = 0;
    std::size_t point_ = 0;
};
std::vector<points::RelaySample> relay_samples(const std::vector<points::RelayStatus>& relays);

/// Tells those who listen, if anybody does, what has happened on a line.
void publish(web::EventHub& hub, const Plant& plant, const std::string& line,
             const bus::BusEvent& event);
/// The same: what has become of the points that are among these wants of the station's polls.
void publish_points(web::EventHub& hub, const Station& station,
                    const std::vector<std::size_t>& wants, TimePoint now);

/// Keeps what has become of the points among them, where the station has a history.
void remember(Station& station, const std::vector<std::size_t>& wants, TimePoint now);

/// What is served: one configuration and the plant made of it, as lines run. A reload makes
/// another; whoever works on this one keeps it to the end of what it does. Does not move.
struct Scene {
    std::shared_ptr<const config::Config> config;
    std::vector<std::shared_ptr<RunningLine>> lines;  ///< by the order of config->lines
    Plant plant;
    /// By the same order; empty where nothing is kept.
    std::vector<std::shared_ptr<bus::LineHistory>> histories;
    web::Directory directory;  ///< REST's view of it all

    Scene() = default;
    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;
};

/// Of lines that run as the configuration says, in its order.
std::shared_ptr<Scene> make_scene(std::shared_ptr<const config::Config> config,
                                  std::vector<std::shared_ptr<RunningLine>> lines);
/// The past of its points is kept from now on, and of what is the same in `before` (may be null)
/// it goes on; `lines` keeps that of its lines.
void keep_histories(Scene& scene, const Scene* before, LineHistories& lines);

}  // namespace panelgate::app
