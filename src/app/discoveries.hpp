#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "line_discovery.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/web/api/discovery_source.hpp"
#include "panelgate/web/http/event_hub.hpp"
#include "plant.hpp"

namespace panelgate::app {

/// The last search for stations of each line. What it is given outlives it, but for the buses'
/// last answers.
class Discoveries final : public web::DiscoverySource {
  public:
    /// What is there when somebody asks.
    struct Place {
        const Plant& plant;
        std::shared_ptr<const profile::Catalogue> profiles;
    };
    Discoveries(rt::Clock& clock, std::function<Place()> place, web::EventHub& hub)
        : clock_(clock), place_(std::move(place)), hub_(hub) {}

    std::optional<std::string> start(std::string_view line, std::string_view stations,
                                     unsigned share_percent) override;
    void stop(std::string_view line) override;
    web::DiscoveryReport report(std::string_view line) const override;
    /// The program ends: all of them.
    void stop_all();

  private:
    void tell(const std::string& line) const;

    rt::Clock& clock_;
    std::function<Place()> place_;
    web::EventHub& hub_;
    std::map<std::string, std::shared_ptr<LineDiscovery>, std::less<>> by_line_;
};

}  // namespace panelgate::app
