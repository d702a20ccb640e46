#pragma once

#include <cstddef>
#include <deque>
#include <string>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/points/counters.hpp"
#include "panelgate/points/relay_status.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/web/api/directory.hpp"
#include "panelgate/web/http/event_hub.hpp"
#include "plant.hpp"

namespace panelgate::app {

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

}  // namespace panelgate::app
