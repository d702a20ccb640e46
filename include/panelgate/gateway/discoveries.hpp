#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/gateway/plant.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/scan/discovery.hpp"
#include "panelgate/web/api/sources.hpp"
#include "panelgate/web/http/event_hub.hpp"

namespace panelgate::gateway {

/// One discovery on one line: sends the requests of a scan::Discovery to the bus as a client of the
/// lowest class, and charges it with the line time that the bus reports. One thread.
class LineDiscovery : public std::enable_shared_from_this<LineDiscovery> {
  public:
    using State = web::DiscoveryReport::State;

    /// Clock and bus outlive it. `on_step` is called after each step.
    LineDiscovery(rt::Clock& clock, bus::BusClient& bus,
                  std::shared_ptr<const profile::Catalogue> profiles,
                  scan::DiscoverySettings settings, std::function<void()> on_step);

    void start();
    /// Sends nothing more and cancels the queued request.
    void stop(const std::string& why) { end(State::stopped, why); }
    State state() const { return state_; }
    const scan::Discovery& discovery() const { return discovery_; }
    /// The report without its YAML.
    web::DiscoveryReport report() const;

  private:
    void step();
    void ask(const scan::ReadRequest& request);
    void on_answer(const bus::Answer& answer);
    void ask_late_stations();
    Duration used() const;
    void end(State state, std::string why);

    rt::Clock& clock_;
    bus::BusClient& bus_;
    std::shared_ptr<const profile::Catalogue> profiles_;
    scan::Discovery discovery_;
    unsigned share_percent_;
    std::function<void()> on_step_;
    bus::ClientId client_;
    WhoRef who_;
    std::unique_ptr<rt::Alarm> alarm_;
    State state_ = State::running;
    std::string why_;
    TimePoint began_;
    TimePoint ended_;
    TimePoint asked_{};
    Duration bus_total_{};  ///< line time used in total, once it has ended
    Duration paid_{};       ///< line time used before the outstanding request
};

/// The last discovery of each line. Its constructor arguments outlive it, except for the last
/// answers of the buses.
class Discoveries final : public web::DiscoverySource {
  public:
    /// The current plant and profiles.
    struct Place {
        const Plant& plant;
        std::shared_ptr<const profile::Catalogue> profiles;
    };
    Discoveries(rt::Clock& clock, std::function<Place()> place, web::EventOutlet& events)
        : clock_(clock), place_(std::move(place)), events_(events) {}

    std::optional<std::string> start(std::string_view line, std::string_view stations,
                                     unsigned share_percent) override;
    void stop(std::string_view line) override;
    web::DiscoveryReport report(std::string_view line) const override;
    /// Stops all discoveries when the program ends.
    void stop_all();

  private:
    void report_progress(const std::string& line) const;

    rt::Clock& clock_;
    std::function<Place()> place_;
    web::EventOutlet& events_;
    std::map<std::string, std::shared_ptr<LineDiscovery>, std::less<>> by_line_;
};

}  // namespace panelgate::gateway
