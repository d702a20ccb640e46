#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "panelgate/bus/bus_client.hpp"
#include "panelgate/points/station_polls.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::points {

/// The reads wanted of one station.
struct PolledStation {
    std::uint8_t id = 1;
    std::vector<Want> wants;
    PlanLimits limits;
    SharedMemory memory{};
    std::string name{};  ///< the station's name; empty: its id is used
};

/// Polls one line through its bus, with requests of class `poll`: one outstanding per station.
/// Written items become stale at once and are read again out of turn. Single-threaded; clock and
/// bus outlive it.
class Poller {
  public:
    /// Called after each answer, with the station's id and its wants that were read or failed; and
    /// after a write, with the wants that became outdated.
    using Update = std::function<void(std::uint8_t station, const std::vector<std::size_t>& wants)>;

    Poller(rt::Clock& clock, bus::RequestPort& bus, std::vector<PolledStation> stations);
    ~Poller();
    Poller(const Poller&) = delete;
    Poller& operator=(const Poller&) = delete;

    /// Replaces the polled stations. Unchanged stations continue; readings of the same items are
    /// kept.
    void apply(std::vector<PolledStation> stations);

    void on_update(Update update);
    /// Returns the function to call with each write on this line; it may outlive the poller.
    std::function<void(const bus::WriteEvent&)> write_listener() const;
    void start();
    /// Stops polling and cancels waiting requests.
    void stop();

    /// Returns the polls of this station, or null if it is not polled. May outlive the poller.
    std::shared_ptr<const StationPolls> find(std::uint8_t station) const;

  private:
    struct State;
    std::shared_ptr<State> state_;  ///< shared with outstanding requests
};

}  // namespace panelgate::points
