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

/// What one station of a line is asked for.
struct PolledStation {
    std::uint8_t id = 1;
    std::vector<Want> wants;
    PlanLimits limits;
    SharedMemory memory{};
    std::string name{};  ///< of the station, for people; empty: it is called by its id
};

/// Runs the polls of one line through its bus, as requests of the class `poll`: one under way a
/// station. What somebody writes is stale at once and read again out of turn. One thread; clock and
/// bus outlive it.
class Poller {
  public:
    /// Called after each answer, with the station's id and its wants that were read or failed; and
    /// with those that a write has just made old.
    using Update = std::function<void(std::uint8_t station, const std::vector<std::size_t>& wants)>;

    Poller(rt::Clock& clock, bus::BusClient& bus, std::vector<PolledStation> stations);
    ~Poller();
    Poller(const Poller&) = delete;
    Poller& operator=(const Poller&) = delete;

    /// From now on these are polled. What is the same goes on as it was; what was known of the same
    /// items still is.
    void apply(std::vector<PolledStation> stations);

    void on_update(Update update);
    /// For whoever hears of the writes on this line; may be called when the poller is gone.
    std::function<void(const bus::WriteEvent&)> write_listener() const;
    void start();
    /// Takes what waits back from the bus.
    void stop();

    /// Of the station with this id; null when it is not polled. May outlive the poller.
    std::shared_ptr<const StationPolls> find(std::uint8_t station) const;

  private:
    struct State;
    std::shared_ptr<State> state_;  ///< shared with answers that are still under way
};

}  // namespace panelgate::points
